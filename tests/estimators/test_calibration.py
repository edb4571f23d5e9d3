"""Calibration recovers the geometry, bias, scale and delays that made the samples, and refuses what the drive does not show."""

import math

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from drivers.interface.kinematics import OmniThreeWheel, SkidSteer
from drivers.interface.samples import ImuSample, Stamp, TruthSample
from drivers.interface.seeds import stream
from estimators.calibration.base import calibrate_base
from estimators.calibration.closure import calibrate_loops
from estimators.calibration.drive import drive_of
from estimators.calibration.gyro import calibrate_gyro
from estimators.calibration.identify import Unknown, identify
from estimators.calibration.loops import loops_of
from estimators.calibration.wheels import calibrate_wheels, wheel_path
from estimators.odometry.wheel_geometry import TwoSided
from tests.estimators.scenes import MS, wheels

OMNI = OmniThreeWheel.symmetric(wheel_radius_m=0.05, wheel_distance_m=0.1, first_bearing_rad=1.0)
TRUE_OMNI = OmniThreeWheel((0.051, 0.0495, 0.0503), (0.101, 0.0985, 0.1), OMNI.wheel_bearing_rad, (0.026, -0.02, 0.01))
SKID = SkidSteer(wheel_radius_m=0.098, effective_track_m=0.6)
TRUE_SKID = TwoSided(0.099, 0.0975, 0.57)
STEP_S = 0.01
ALL_WAYS = [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.0, 0.6), (-0.3, 0.0, -0.6), (0.2, -0.2, 0.0), (0.3, 0.0, 0.5)] * 2
NO_STRAFING = [(0.3, 0.0, 0.0), (0.0, 0.0, 0.6), (-0.3, 0.0, 0.0), (0.3, 0.0, -0.5)]


def driven(true, twists, **how):
    return drive_of(*samples(true, twists, **how))


def samples(true, twists, *, wheels_late_s=0.0, gyro_late_s=0.0, bias=0.0, scale=1.0, noise=0.0, leg_s=6.0):
    """Samples of a drive at 100 Hz, each twist fading in and out; what is late bears a later stamp."""
    random = stream(0, "calibration")
    pose, angles = SE2(), np.zeros(true.wheel_count)
    base, imu, truth = [], [], []
    steps = round(leg_s / STEP_S)
    fade = np.sin(np.linspace(0.0, math.pi, steps)) ** 2
    for index, (leg, share) in enumerate((leg, share) for leg in twists for share in fade):
        twist = BodyTwist(*(value * float(share) for value in leg))
        time_ns = index * 10 * MS
        truth.append(TruthSample(Stamp(time_ns, time_ns, index), pose, twist, (), 1.0, ()))
        counted = angles + noise * random.standard_normal(len(angles))
        base.append(wheels(time_ns + round(wheels_late_s * 1e9), counted, angles))
        said = (twist.wz + bias) / scale + float(noise * random.standard_normal())
        stamp_ns = time_ns + round(gyro_late_s * 1e9) + 5 * MS  # the rate of the interval, at its middle
        imu.append(ImuSample(Stamp(stamp_ns, stamp_ns, index), (0.0, 0.0, said), (0.0, 0.0, 9.81)))
        pose = pose.integrate(twist.vx, twist.vy, twist.wz, STEP_S)
        angles = angles + true.wheel_rates(twist) * STEP_S
    return base, imu, truth


def test_every_number_of_an_omni_base_is_found():
    drive = driven(TRUE_OMNI, ALL_WAYS, noise=1e-3)
    calibration = calibrate_wheels(drive, OMNI)
    found = calibration.geometry.kinematics
    np.testing.assert_allclose(found.wheel_radius_m, TRUE_OMNI.wheel_radius_m, rtol=1e-3)
    np.testing.assert_allclose(found.wheel_distance_m, TRUE_OMNI.wheel_distance_m, rtol=4e-3)
    np.testing.assert_allclose(found.heading_error_rad, TRUE_OMNI.heading_error_rad, atol=1e-3)
    assert abs(calibration.late_s) < 1e-3
    assert len(calibration.found) == 10


def test_radii_and_track_of_a_skid_steer_base_are_found():
    found = calibrate_wheels(driven(TRUE_SKID, NO_STRAFING, noise=1e-3), SKID).geometry
    assert found.left_radius_m == pytest.approx(0.099, rel=1e-3)
    assert found.right_radius_m == pytest.approx(0.0975, rel=1e-3)
    assert found.effective_track_m == pytest.approx(0.57, rel=3e-3)


def test_bias_scale_and_delays_are_found():
    drive = driven(TRUE_OMNI, ALL_WAYS, bias=0.01, scale=1.03, gyro_late_s=0.012, wheels_late_s=0.02, noise=2e-4)
    gyro = calibrate_gyro(drive)
    assert gyro.bias_rad_s == pytest.approx(0.01, abs=2e-4)
    assert gyro.scale == pytest.approx(1.03, abs=1e-3)
    assert gyro.late_s == pytest.approx(0.012, abs=1e-3)
    assert calibrate_base(drive, OMNI).wheels_late_s == pytest.approx(0.008, abs=1.5e-3)


def test_the_true_values_lie_within_three_standard_deviations():
    calibration = calibrate_base(driven(TRUE_OMNI, ALL_WAYS, bias=0.01, noise=2e-3), OMNI)
    true = [*TRUE_OMNI.wheel_radius_m, *TRUE_OMNI.wheel_distance_m, *TRUE_OMNI.heading_error_rad, 0.0, 0.01, 1.0, 0.0]
    for parameter, value in zip(calibration.found, true, strict=True):
        assert abs(parameter.value - value) < 3.0 * parameter.std, parameter.unknown.name


def test_the_odometry_is_better_afterwards():
    calibration = calibrate_base(driven(TRUE_OMNI, ALL_WAYS, noise=1e-4), OMNI)
    assert calibration.after.way_rms_m < 0.1 * calibration.before.way_rms_m
    assert calibration.after.end_rad < 0.1 * calibration.before.end_rad


@pytest.mark.parametrize(
    ("true", "nominal", "legs", "named"),
    [
        (TRUE_OMNI, OMNI, [(0.3, 0.0, 0.0)], "wheel_"),
        (TRUE_OMNI, OMNI, [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0)], "wheel_distance_m"),
        (TRUE_OMNI, OMNI, [(0.0, 0.0, 0.0)], "wheel_|heading_"),
        (TRUE_SKID, SKID, [(0.3, 0.0, 0.0), (-0.3, 0.0, 0.0)], "effective_track_m"),
        (TRUE_SKID, SKID, [(0.0, 0.0, 0.5)], "left_radius_m|right_radius_m|effective_track_m"),
    ],
)
def test_what_the_drive_does_not_show_is_refused_by_name(true, nominal, legs, named):
    with pytest.raises(ConfigurationError, match=f"do not determine '({named})"):
        calibrate_wheels(driven(true, legs), nominal)


def test_a_gyro_that_never_turned_has_no_scale():
    with pytest.raises(ConfigurationError, match=r"do not determine 'gyro_(scale|late_s)'"):
        calibrate_gyro(driven(TRUE_OMNI, [(0.3, 0.0, 0.0)]))


def test_too_few_samples_are_refused():
    with pytest.raises(ConfigurationError, match="0 wheel samples"):
        drive_of([], [], [])


def test_slip_is_an_outlier_not_a_parameter():
    drive = driven(TRUE_SKID, NO_STRAFING)
    drive.wheel_rad[700:, 0::2] += 3.0  # the left wheels spun for a moment
    found = calibrate_wheels(drive, SKID).geometry
    assert found.left_radius_m == pytest.approx(0.099, rel=3e-3)


def test_standard_deviations_are_those_of_a_line():
    """A straight line through points of unit noise: the textbook's covariance."""
    x = np.linspace(-1.0, 1.0, 21)
    noise = stream(0, "line").standard_normal(21)
    unknowns = (Unknown("offset", "", 0.0, 1.0, 10.0), Unknown("slope", "", 0.0, 1.0, 10.0))
    offset, slope = identify(unknowns, lambda v: v[0] + v[1] * x - (1.0 + 2.0 * x + 0.1 * noise))
    assert offset.std == pytest.approx(1.0 / math.sqrt(21), rel=0.01)
    assert slope.std == pytest.approx(1.0 / math.sqrt((x**2).sum()), rel=0.01)
    assert slope.value == pytest.approx(2.0, abs=0.1)


def test_the_path_of_a_circle_is_exact():
    twist = BodyTwist(0.3, 0.0, 0.5)
    samples = [wheels(i * 100 * MS, SKID.wheel_rates(twist) * 0.1 * i, SKID.wheel_rates(twist)) for i in range(41)]
    truth = [TruthSample(Stamp(i * 400 * MS, 0, i), SE2(), twist, (), 1.0, ()) for i in range(11)]
    path = wheel_path(drive_of(samples, [], truth, spacing_s=0.2), SKID)
    end = SE2().integrate(0.3, 0.0, 0.5, 4.0)
    assert path[-1, 0] == pytest.approx(end.x)
    assert path[-1, 1] == pytest.approx(end.y)


def leg(way_m, bearing):
    """A straight way; its fading halves what its twist would make."""
    speed = 2.0 * way_m / 6.0
    return (speed * math.cos(bearing), speed * math.sin(bearing), 0.0)


def corner(sense):
    """A quarter of a turn."""
    return (0.0, 0.0, sense * math.pi / 6.0)


def square_loop(side, sense):
    """Four sides and four corners in one sense."""
    return [leg(side, 0.0), corner(sense)] * 4


def there_and_back_otherwise(way_m, sense, bearing):
    """Out along one bearing, a quarter of a turn, back along another, and on until it is a whole turn."""
    return [leg(way_m, bearing), corner(sense), leg(way_m, bearing + math.pi - sense * 0.5 * math.pi), *[corner(sense)] * 3]


def looped(true, loop, **how):
    """A loop between two rests."""
    rest = [(0.0, 0.0, 0.0)]
    return samples(true, rest + loop + rest, noise=1e-3, **how)[:2]


@pytest.mark.parametrize(("true", "nominal"), [(TRUE_OMNI, OMNI), (TRUE_SKID, SKID)])
def test_loops_in_both_senses_tell_ratios_and_track_but_no_mean_radius(true, nominal):
    drives = [square_loop(2.0, sense) for sense in (1, -1)]
    if true is TRUE_OMNI:
        drives += [there_and_back_otherwise(2.0, sense, bearing) for sense in (1, -1) for bearing in (0.0, 0.5 * math.pi)]
    loops = [loop for drive in drives for loop in loops_of(*looped(true, drive, bias=0.004, scale=1.02), nominal)]
    calibration = calibrate_loops(loops, nominal)
    assert len(loops) == len(drives)
    assert calibration.after.end_m < 0.1 * calibration.before.end_m
    assert calibration.after.end_rad < 0.1 * calibration.before.end_rad
    assert any("mean" in name for name in calibration.held)
    geometry = calibration.wheels.geometry
    if isinstance(nominal, SkidSteer):
        assert geometry.left_radius_m / geometry.right_radius_m == pytest.approx(0.099 / 0.0975, rel=1e-3)
        assert geometry.left_radius_m + geometry.right_radius_m == pytest.approx(2 * 0.098)
        scale = geometry.right_radius_m / 0.0975
        assert geometry.effective_track_m / scale == pytest.approx(0.57, rel=5e-3)
    else:
        ratio = np.divide(geometry.wheel_radius_m, TRUE_OMNI.wheel_radius_m)
        assert np.ptp(ratio) < 3e-3
        assert np.sum(geometry.wheel_radius_m) == pytest.approx(0.15)
    assert calibration.gyro.bias_rad_s == pytest.approx(0.004, abs=3e-4)
    assert calibration.gyro.scale == pytest.approx(1.02, abs=2e-3)


def test_loops_to_one_side_and_loops_that_do_not_close_are_refused():
    left = loops_of(*looped(TRUE_SKID, square_loop(2.0, 1)), SKID)
    with pytest.raises(ConfigurationError, match="one sense"):
        calibrate_loops(left * 2, SKID)
    open_end = loops_of(*samples(TRUE_SKID, [*square_loop(2.0, -1), (0.2, 0.0, 0.0)])[:2], SKID)
    with pytest.raises(ConfigurationError, match="would close"):
        calibrate_loops([*left, *open_end], SKID)


def test_loops_that_an_omni_base_drives_forwards_only_are_refused_by_name():
    loops = [loop for sense in (1, -1) for loop in loops_of(*looped(TRUE_OMNI, square_loop(2.0, sense)), OMNI)]
    with pytest.raises(ConfigurationError, match=r"do not determine '(wheel_radius|heading_error)"):
        calibrate_loops(loops, OMNI)


def test_one_recording_is_cut_where_the_base_stands_on_the_mark():
    rest = [(0.0, 0.0, 0.0)]
    legs = rest + square_loop(2.0, 1) + rest + square_loop(2.0, -1) + rest
    base, imu, _ = samples(TRUE_SKID, legs)
    loops = loops_of(base, imu, SKID)
    assert [round(loop.references.pose[-1, 2] / math.tau) for loop in loops] == [1, -1]
    assert calibrate_loops(loops, SKID).after.end_m < 0.01
