"""The camera's mounting from the ground it sees: known tilts, obstacles in view, walls only."""

import math

import numpy as np
import pytest

from drivers.interface.errors import ConfigurationError
from drivers.interface.samples import DepthFrame, Intrinsics, Stamp, frozen_array
from drivers.interface.seeds import stream
from estimators.calibration.ground import calibrate_camera, mounting_of
from tests.estimators.scenes import ORIGIN, Floor, Pillar, Wall, depth_image, level_camera

FRAMES = 12
K = Intrinsics(212, 120, 108.6, 108.6, 107.6, 59.7)
CLUTTER = [Pillar(1.2, 0.3, 0.15), Pillar(1.6, -0.5, 0.3, top_m=0.25), Wall(0.3, 4.5)]


def frames(solids, true, believed, subpixel_px=0.08):
    """What a stereo camera with the mounting `true` sees, sent with the mounting that is believed; noise of a D455."""
    random = stream(0, "ground")
    found = []
    for index in range(FRAMES):

        def spoil(depth):
            seen = np.where((depth < 20.0), depth, 0.0)
            noisy = seen + subpixel_px * seen**2 / (434.0 * 0.095) * random.standard_normal(depth.shape)
            return np.where((depth < 20.0), noisy, np.inf)

        image = frozen_array(depth_image(solids, ORIGIN, true, K, spoil=spoil))
        found.append(DepthFrame(Stamp(index, index, index), image, 0.001, K, believed))
    return found


@pytest.mark.parametrize("height_m", [0.25, 0.4, 1.2])
@pytest.mark.parametrize("pitch_rad", [-0.03, 0.0, 0.3])
@pytest.mark.parametrize("roll_rad", [0.0, 0.06])
@pytest.mark.parametrize("solids", [[Floor()], [Floor(), *CLUTTER]])
def test_height_and_tilt_are_recovered_within_three_standard_deviations(height_m, pitch_rad, roll_rad, solids):
    true = level_camera(height_m, pitch_rad, roll_rad)
    calibration = calibrate_camera(frames(solids, true, level_camera(height_m + 0.05, pitch_rad + 0.04, 0.0)))
    for parameter, value in zip(calibration.found, (height_m, pitch_rad, roll_rad), strict=True):
        assert abs(parameter.value - value) < 3.0 * parameter.std, parameter
    assert calibration.found[0].std < 0.003
    assert max(parameter.std for parameter in calibration.found[1:]) < 0.003
    assert calibration.residual_m < 0.02


@pytest.mark.parametrize(
    "solids",
    [[Wall(0.0, 1.5)], [Floor(), Wall(0.0, 0.85)], [Wall(0.0, 0.6), Wall(1.2, 0.9)], [Wall(0.2, 2.0), Pillar(1.0, 0.2, 0.2)], []],
)
def test_without_ground_in_view_it_is_refused(solids):
    mounting = level_camera(0.4)
    with pytest.raises(ConfigurationError, match="no ground is visible"):
        calibrate_camera(frames(solids, mounting, mounting))


def test_a_table_is_not_the_ground():
    """A level surface at half the height, with the floor seen around it, holds most of the points."""

    class Table:
        def depth(self, origin, rays):
            down = (0.5 - origin[2]) / np.where(np.abs(rays[..., 2]) < 1e-12, 1e-12, rays[..., 2])
            at = origin + down[..., None] * rays
            on = (down > 0.0) & (np.abs(at[..., 0] - 1.2) < 0.5) & (np.abs(at[..., 1]) < 0.5)
            return np.where(on, down, np.inf)

    true = level_camera(1.2, 0.6)
    calibration = calibrate_camera(frames([Floor(), Table()], true, true))
    assert calibration.values["z_m"] == pytest.approx(1.2, abs=0.005)


def test_a_mounting_is_read_from_its_transform():
    for pitch, roll in ((0.3, -0.2), (-0.1, 0.05), (0.0, 0.0)):
        assert mounting_of(level_camera(0.4, pitch, roll)) == pytest.approx((0.4, pitch, roll))


def test_the_wrong_sign_of_pitch_in_the_configuration_is_put_right():
    true = level_camera(0.4, 0.2)
    calibration = calibrate_camera(frames([Floor(), Wall(0.0, 4.0)], true, level_camera(0.4, -0.2)))
    assert math.isclose(calibration.values["pitch_rad"], 0.2, abs_tol=0.003)
