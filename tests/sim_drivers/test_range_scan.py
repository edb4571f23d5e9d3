"""The planar scanner against distances in closed form."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from drivers.interface.devices import DeviceSetup
from drivers.interface.geometry import SE2
from sim_drivers.range_scan import RangeScannerSettings, SimRangeScanner
from sim_drivers.scene import Scene, Shape, StaticObstacle
from sim_drivers.world import MujocoWorld, WorldSettings

PERFECT = {"noise_m": 0.0, "dropout_probability": 0.0}
PILLAR = StaticObstacle("pillar", Shape.cylinder(0.3, 1.0), SE2(3.0, 1.0, 0.0))


def scans(*static, start=None, seed=1, seconds=0.2, **settings):
    world = MujocoWorld(Scene("test", start or SE2(), (), 60.0, tuple(static)), WorldSettings(physics_step_s=0.001))
    scanner = SimRangeScanner(RangeScannerSettings(**settings), DeviceSetup("scan", seed, lambda: world.now_ns, world))
    world.compile()
    scanner.open()
    world.step_to(round(seconds * 1e9))
    return scanner.drain()


def angles(scan):
    return scan.angle_min_rad + scan.angle_step_rad * np.arange(len(scan.range_m))


def test_a_pillar_is_seen_where_it_stands():
    start = SE2(1.0, -1.0, 0.4)
    scan = scans(PILLAR, start=start, **PERFECT)[0]
    hit = np.isfinite(scan.range_m)
    points = np.stack((np.cos(angles(scan)), np.sin(angles(scan))), axis=1)[hit] * scan.range_m[hit, None]
    from_centre = start.apply(points) - (3.0, 1.0)
    np.testing.assert_allclose(np.hypot(*from_centre.T), 0.3, atol=1e-9)
    distance = math.hypot(2.0, 2.0)
    assert hit.sum() == pytest.approx(2 * math.asin(0.3 / distance) / scan.angle_step_rad, abs=1.0)


def test_the_first_and_the_last_beam_point_where_the_settings_say():
    scan = scans(PILLAR, angle_min_rad=-1.0, angle_max_rad=0.5, beams=31)[0]
    assert angles(scan)[[0, -1]].tolist() == pytest.approx([-1.0, 0.5])


def test_below_and_above_the_plane_nothing_is_seen():
    low = StaticObstacle("low", Shape.box(0.5, 0.5, 0.1), SE2(1.0, 0.0, 0.0))
    high = StaticObstacle("high", Shape.box(0.5, 0.5, 0.1), SE2(0.0, 1.0, 0.0), base_z_m=0.5)
    assert np.isinf(scans(low, high, height_m=0.2, **PERFECT)[0].range_m).all()


def test_too_far_is_no_return_and_too_near_is_invalid():
    ring = [StaticObstacle(f"wall{i}", Shape.box(0.02, 9.0, 1.0), SE2(x, 0.0, 0.0)) for i, x in enumerate((0.5, -4.0))]
    scan = scans(*ring, range_min_m=0.6, range_max_m=3.0, angle_min_rad=-3.1, angle_max_rad=3.1, **PERFECT)[0]
    ahead, behind = np.abs(angles(scan)) < 0.5, np.abs(angles(scan)) > 2.9
    assert np.isnan(scan.range_m[ahead]).all()
    assert np.isinf(scan.range_m[behind]).all()


def test_noise_is_as_large_as_the_settings_say():
    wall = StaticObstacle("wall", Shape.box(0.2, 50.0, 1.0), SE2(2.1, 0.0, 0.0))
    shape = {"angle_min_rad": -0.5, "angle_max_rad": 0.5, "beams": 4000}
    noisy = scans(wall, **shape, noise_m=0.02, dropout_probability=0.05)[0]
    error = noisy.range_m - 2.0 / np.cos(angles(noisy))
    assert np.nanstd(error) == pytest.approx(0.02, rel=0.05)
    assert np.isnan(error).mean() == pytest.approx(0.05, abs=0.01)


def test_scans_come_at_their_rate_and_late_and_the_same_for_the_same_seed():
    first, again, other = (scans(PILLAR, seed=seed) for seed in (1, 1, 2))
    assert [scan.stamp.captured_ns for scan in first] == [25_000_000 * k for k in range(1, 8)]
    assert all(scan.stamp.received_ns - scan.stamp.captured_ns == 25_000_000 for scan in first)
    assert all(np.array_equal(a.range_m, b.range_m, equal_nan=True) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[0].range_m, other[0].range_m, equal_nan=True)


@pytest.mark.parametrize("wrong", [{"angle_min_rad": 1.0, "angle_max_rad": 0.0}, {"range_min_m": 5.0, "range_max_m": 4.0}])
def test_settings_that_contradict_each_other_are_refused(wrong):
    with pytest.raises(ValidationError, match="must be below"):
        RangeScannerSettings(**wrong)
