"""Odometry: closed loops against exact kinematics, late and lost and bad samples, device poses, truth."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.kinematics import OmniThreeWheel, SkidSteer
from drivers.interface.samples import ImuSample, PoseSample, Stamp, TruthSample
from estimators.belief import EstimatorFault
from estimators.odometry.dead_reckoning import DeadReckoning, DeadReckoningSettings
from estimators.odometry.odometry import PoseTrail
from estimators.odometry.truth_odometry import TruthOdometry
from tests.estimators.scenes import MS, sensed, wheels

OMNI = OmniThreeWheel.symmetric(wheel_radius_m=0.05, wheel_distance_m=0.1)
SKID = SkidSteer(wheel_radius_m=0.098, effective_track_m=0.6)
INVALID = (EstimatorFault.INVALID_INPUT,)
PERIOD_NS = 5 * MS


def samples_of(kinematics, twists, period_ns=PERIOD_NS):
    """Wheel samples of a drive that holds each twist for one period, and its exact poses."""
    position, pose = np.zeros(kinematics.wheel_count), SE2()
    samples, poses = [wheels(0, position, np.zeros(kinematics.wheel_count))], [pose]
    for index, twist in enumerate(twists, start=1):
        rates = kinematics.wheel_rates(twist)
        position = position + rates * period_ns * 1e-9
        pose = pose.integrate(twist.vx, twist.vy, twist.wz, period_ns * 1e-9)
        samples.append(wheels(index * period_ns, position, rates))
        poses.append(pose)
    return samples, poses


def drive(odometry, samples, tick_ns=50 * MS, **more):
    """Feed samples tick by tick and return the estimate at the last sample's time."""
    end_ns = samples[-1].stamp.captured_ns
    estimate = None
    for start_ns in range(0, end_ns + 1, tick_ns):
        batch = [s for s in samples if start_ns - tick_ns < s.stamp.captured_ns <= start_ns]
        estimate = odometry.update(sensed(start_ns, base=batch, **more))
    return estimate


def reckoning(kinematics, **settings):
    return DeadReckoning(DeadReckoningSettings(**settings), kinematics)


def assert_pose(pose, expected, tolerance=1e-9):
    assert pose.distance(expected) < tolerance
    assert abs(math.remainder(pose.yaw - expected.yaw, 2.0 * math.pi)) < tolerance


def square(speed, vy=0.0):
    """Four sides of one metre and four right-angle turns, in steps of 5 ms."""
    side = [BodyTwist(speed, vy, 0.0)] * round(1.0 / (speed * 0.005))
    turn = [BodyTwist(0.0, 0.0, math.pi / 2.0)] * 200
    return (side + turn) * 4


@pytest.mark.parametrize(("kinematics", "vy"), [(OMNI, 0.0), (OMNI, 0.2), (SKID, 0.0)])
def test_a_square_closes(kinematics, vy):
    samples, poses = samples_of(kinematics, square(0.5, vy))
    estimate = drive(reckoning(kinematics), samples)
    assert estimate.faults == ()
    assert_pose(estimate.odom_from_base, poses[-1])
    assert_pose(estimate.odom_from_base, SE2())


@pytest.mark.parametrize("kinematics", [OMNI, SKID])
def test_a_circle_is_exact_however_coarse_the_samples(kinematics):
    twists = [BodyTwist(0.6, 0.0, 0.9)] * 40
    samples, poses = samples_of(kinematics, twists, period_ns=100 * MS)
    assert_pose(drive(reckoning(kinematics), samples, tick_ns=100 * MS).odom_from_base, poses[-1])


def test_lost_samples_lose_no_way():
    twists = [BodyTwist(0.4, 0.1, 0.3)] * 400
    samples, poses = samples_of(OMNI, twists)
    kept = [s for index, s in enumerate(samples) if index % 7 in (0, 3) or index == 400]
    assert_pose(drive(reckoning(OMNI), kept).odom_from_base, poses[-1])


def test_samples_are_believed_at_their_capture_and_the_last_twist_goes_on():
    samples, _ = samples_of(OMNI, [BodyTwist(0.5, 0.0, 0.4)] * 20)
    odometry = reckoning(OMNI, extrapolation_max_s=0.2)
    late = odometry.update(sensed(130 * MS, base=samples))
    assert late.newest_capture_ns == 100 * MS
    assert_pose(late.odom_from_base, SE2().integrate(0.5, 0.0, 0.4, 0.13))
    silent = odometry.update(sensed(5000 * MS))
    assert_pose(silent.odom_from_base, SE2().integrate(0.5, 0.0, 0.4, 0.3))


def test_the_pose_at_a_past_time_lies_on_the_way():
    samples, poses = samples_of(OMNI, [BodyTwist(0.5, 0.1, 1.0)] * 100)
    odometry = reckoning(OMNI)
    drive(odometry, samples)
    assert_pose(odometry.pose_at(60 * PERIOD_NS), poses[60])
    between = poses[60].integrate(0.5, 0.1, 1.0, 0.0025)
    assert_pose(odometry.pose_at(60 * PERIOD_NS + PERIOD_NS // 2), between, tolerance=1e-5)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda s: replace(s, position_rad=np.array([math.nan, 0.0, 0.0])),
        lambda s: replace(s, velocity_rad_s=np.array([0.0, math.inf, 0.0])),
        lambda s: replace(s, position_rad=np.zeros(4), velocity_rad_s=np.zeros(4)),
        lambda s: replace(s, position_rad=np.array([0.0, -math.inf, 0.0])),
        lambda s: replace(s, stamp=Stamp(2 * PERIOD_NS, 0, 0)),  # from the past
        lambda s: replace(s, stamp=Stamp(9 * PERIOD_NS, 0, 0)),  # the same time again
        lambda s: replace(s, stamp=Stamp(0, 0, 0)),
        lambda s: replace(s, stamp=Stamp(-PERIOD_NS, 0, 0)),  # before time began
        lambda s: replace(s, stamp=Stamp(-(2**62), 0, 0)),
        lambda s: replace(s, stamp=Stamp(10**12, 0, 0)),  # from the future
    ],
)
def test_bad_samples_are_dropped_and_flagged(spoil):
    samples, poses = samples_of(OMNI, [BodyTwist(0.4, 0.1, 0.3)] * 20)
    samples[10] = spoil(samples[10])
    estimate = reckoning(OMNI).update(sensed(20 * PERIOD_NS, base=samples))
    assert estimate.faults == INVALID
    assert_pose(estimate.odom_from_base, poses[20])


@pytest.mark.parametrize("jump_rad", [1000.0, -1000.0, 0.4, -math.tau * 2**16, 1e12])  # reset, slipped a tooth, wrapped
def test_a_counter_that_jumps_moves_nothing_and_counting_goes_on(jump_rad):
    samples, poses = samples_of(OMNI, [BodyTwist(0.4, 0.0, 0.0)] * 20)
    shifted = [replace(s, position_rad=s.position_rad + jump_rad) for s in samples[10:]]
    estimate = reckoning(OMNI).update(sensed(20 * PERIOD_NS, base=samples[:10] + shifted))
    assert estimate.faults == INVALID
    assert estimate.odom_from_base.x == pytest.approx(poses[20].x - 0.4 * 0.005, abs=1e-4)  # the one interval is lost
    assert np.isfinite(estimate.covariance).all()


def test_all_samples_with_one_stamp_move_nothing():
    samples, _ = samples_of(OMNI, [BodyTwist(0.4, 0.1, 0.3)] * 20)
    stuck = [replace(s, stamp=Stamp(PERIOD_NS, 0, i)) for i, s in enumerate(samples)]
    estimate = reckoning(OMNI).update(sensed(20 * PERIOD_NS, base=stuck))
    assert estimate.faults == INVALID
    assert_pose(estimate.odom_from_base, SE2())


@pytest.mark.parametrize("pose", [SE2(math.nan, 0.0, 0.0), SE2(0.0, -math.inf, 0.0), SE2(0.0, 0.0, math.nan), SE2(1e9, 0.0, 0.0)])
def test_a_bad_device_pose_is_dropped_and_flagged(pose):
    good = [SE2(0.01 * i, 0.0, 0.0) for i in range(20)]
    poses = [*good[:10], pose, *good[10:]]
    samples = [PoseSample(Stamp(i * PERIOD_NS, 0, i), at, None, np.eye(3)) for i, at in enumerate(poses)]
    estimate = reckoning(None).update(sensed(20 * PERIOD_NS, base=samples))
    assert estimate.faults == INVALID
    assert math.isfinite(estimate.odom_from_base.x + estimate.odom_from_base.y + estimate.odom_from_base.yaw)
    assert estimate.odom_from_base.x == pytest.approx(0.19, abs=0.021)  # an interval or two are lost


def test_wheels_without_kinematics_are_flagged():
    estimate = reckoning(None).update(sensed(0, base=[wheels(0, [0.0], [0.0])]))
    assert estimate.faults == INVALID
    assert_pose(estimate.odom_from_base, SE2())


def test_the_gyro_corrects_slipping_wheels():
    samples, _ = samples_of(SKID, [BodyTwist(0.3, 0.0, 0.5)] * 200)
    gyro = [ImuSample(Stamp(i * PERIOD_NS, 0, i), (0.0, 0.0, 0.4), (0.0, 0.0, 9.81)) for i in range(201)]
    estimate = reckoning(SKID, use_gyro=True).update(sensed(1000 * MS, base=samples, imu=gyro))
    assert_pose(estimate.odom_from_base, SE2().integrate(0.3, 0.0, 0.4, 1.0))
    assert estimate.twist.wz == pytest.approx(0.4)
    ignored = reckoning(SKID).update(sensed(1000 * MS, base=samples, imu=gyro))
    assert_pose(ignored.odom_from_base, SE2().integrate(0.3, 0.0, 0.5, 1.0))


@pytest.mark.parametrize(("captured_ns", "rate"), [(0, math.nan), (0, math.inf), (0, 57.3), (10**12, 0.0)])
def test_a_bad_gyro_sample_is_flagged(captured_ns, rate):
    bad = ImuSample(Stamp(captured_ns, 0, 0), (0.0, 0.0, rate), (0.0, 0.0, 9.81))
    assert reckoning(SKID).update(sensed(0, imu=[bad])).faults == INVALID


def test_device_poses_start_at_the_identity():
    start = SE2(12.0, -7.0, 2.0)
    poses = [start.integrate(0.5, 0.0, 0.3, 0.1 * i) for i in range(11)]
    samples = [PoseSample(Stamp(i * 100 * MS, 0, i), pose, None, np.zeros((3, 3))) for i, pose in enumerate(poses)]
    odometry = reckoning(None)
    assert_pose(odometry.update(sensed(0, base=samples[:1])).odom_from_base, SE2())
    estimate = odometry.update(sensed(1000 * MS, base=samples[1:]))
    assert_pose(estimate.odom_from_base, SE2().integrate(0.5, 0.0, 0.3, 1.0))
    assert estimate.twist.vx == pytest.approx(0.5, abs=1e-3)
    jumped = replace(samples[-1], stamp=Stamp(1100 * MS, 0, 0), local_from_base=SE2(500.0, 0.0, 0.0))
    after = odometry.update(sensed(1100 * MS, base=[jumped]))
    assert after.faults == INVALID
    assert_pose(after.odom_from_base, estimate.odom_from_base)


def test_beside_wheels_a_device_pose_is_left_alone():
    samples, poses = samples_of(OMNI, [BodyTwist(0.4, 0.0, 0.0)] * 20)
    beside = [PoseSample(s.stamp, SE2(9.0, 9.0, 1.0), None, np.zeros((3, 3))) for s in samples]
    mixed = [one for pair in zip(beside, samples, strict=True) for one in pair]
    odometry = reckoning(OMNI)
    odometry.update(sensed(50 * MS, base=mixed[:20]))
    estimate = odometry.update(sensed(100 * MS, base=[*mixed[20:], replace(beside[0], stamp=Stamp(100 * MS + 1, 0, 0))]))
    assert estimate.faults == ()
    assert_pose(estimate.odom_from_base, poses[20])


def test_the_covariance_grows_with_the_way_and_sideways_most():
    samples, _ = samples_of(OMNI, [BodyTwist(0.5, 0.0, 0.0)] * 800)
    halfway = drive(reckoning(OMNI), samples[:401]).covariance
    end = drive(reckoning(OMNI), samples).covariance
    assert np.all(np.linalg.eigvalsh(end) > 0.0)
    assert end[0, 0] == pytest.approx(4e-4 * 2.0)  # per metre, two metres
    assert end[2, 2] == pytest.approx(1e-4 * 2.0)
    assert end[1, 1] == pytest.approx(4e-4 * 2.0 + 1e-4 * 2.0**3 / 3.0, rel=1e-2)  # a random walk of yaw, integrated
    assert end[1, 1] > 2.0 * halfway[1, 1]


def test_the_covariance_at_rest_stays():
    samples, _ = samples_of(OMNI, [BodyTwist()] * 50)
    assert not drive(reckoning(OMNI), samples).covariance.any()


def test_truth_begins_at_the_identity_and_follows():
    start = SE2(3.0, 1.0, 0.7)
    odometry = TruthOdometry(start, 1.0, 0.2)
    twist = BodyTwist(0.5, 0.1, 0.2)
    truths = [
        TruthSample(Stamp(i * 50 * MS, 0, i), start.integrate(0.5, 0.1, 0.2, 0.05 * i), twist, (), 1.0, ()) for i in range(3)
    ]
    for i, truth in enumerate(truths):
        estimate = odometry.update(sensed(i * 50 * MS, truth=truth))
    assert_pose(estimate.odom_from_base, SE2().integrate(0.5, 0.1, 0.2, 0.1))
    assert odometry.update(sensed(100 * MS, truth=truths[1])).faults == INVALID
    bad = replace(truths[2], stamp=Stamp(110 * MS, 0, 0), map_from_base=SE2(math.nan, 0.0, 0.0))
    assert odometry.update(sensed(150 * MS, truth=bad)).faults == INVALID


def test_a_restored_odometry_goes_on_identically():
    samples, _ = samples_of(SKID, [BodyTwist(0.3, 0.0, 0.5)] * 40)
    gyro = [ImuSample(Stamp(i * PERIOD_NS + 1, 0, i), (0.0, 0.0, 0.4), (0.0, 0.0, 9.81)) for i in range(41)]
    first, second = reckoning(SKID, use_gyro=True), reckoning(SKID, use_gyro=True)
    first.update(sensed(100 * MS, base=samples[:20], imu=gyro[:22]))
    second.restore(first.snapshot())
    rest = sensed(200 * MS, base=samples[20:], imu=gyro[22:])
    one, other = first.update(rest), second.update(rest)
    assert one.odom_from_base == other.odom_from_base
    assert one.twist == other.twist
    assert (one.covariance == other.covariance).all()
    assert first.snapshot() == second.snapshot()
    assert first.pose_at(90 * MS) == second.pose_at(90 * MS)


def test_a_trail_forgets_what_is_old_and_turns_the_short_way():
    trail = PoseTrail(span_s=0.1, extrapolation_max_s=0.0)
    for i in range(100):
        trail.append(i * 10 * MS, SE2(float(i), 0.0, 0.0), BodyTwist())
    assert trail.at(0).x == 89.0
    assert trail.at(955 * MS).x == pytest.approx(95.5)
    trail.append(1000 * MS, SE2(0.0, 0.0, 3.1), BodyTwist())
    trail.append(1010 * MS, SE2(0.0, 0.0, -3.1), BodyTwist())
    assert abs(trail.at(1005 * MS).yaw) == pytest.approx(math.pi)
