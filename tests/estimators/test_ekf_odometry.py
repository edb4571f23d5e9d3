"""The Kalman filter of the odometry: closed loops, order of arrival, slip, bad input, divergence, absolute poses."""

import math
from collections import defaultdict
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.kinematics import OmniThreeWheel, SkidSteer
from drivers.interface.samples import ImuSample, PoseSample, Stamp, WheelSample
from drivers.interface.seeds import stream
from estimators.belief import EstimatorFault
from estimators.odometry.ekf_model import STATES, Inertial, moved, transition
from estimators.odometry.odometry_choice import OdometrySettings, build_odometry
from tests.estimators.scenes import MS, sensed, wheels

OMNI = OmniThreeWheel.symmetric(wheel_radius_m=0.05, wheel_distance_m=0.1)
SKID = SkidSteer(wheel_radius_m=0.098, effective_track_m=0.6)
IMU_NS, WHEELS_NS, TICK_NS = 5 * MS, 10 * MS, 50 * MS
STEP_S = IMU_NS * 1e-9


def ekf(kinematics=OMNI, **changes):
    return build_odometry(OdometrySettings(kind="ekf", **changes), kinematics)


def smooth(target, ramp_s=0.4, hold_s=1.0):
    """Twists at the IMU's period: up to the target along half a cosine, there for a while, and down again."""
    ramp = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, round(ramp_s / STEP_S), endpoint=False))
    shape = np.concatenate((ramp, np.ones(round(hold_s / STEP_S)), 1.0 - ramp))
    return [BodyTwist(s * target.vx, s * target.vy, s * target.wz) for s in shape]


class Drive:
    """Samples and true poses of a drive; the twist between two IMU samples is the mean of those at them."""

    def __init__(self, kinematics, twists, bias=0.0, noise=0.0, seed=0):
        random = stream(seed, "drive")
        spoil = noise * random.standard_normal(len(twists))
        pose, angles = SE2(), np.zeros(kinematics.wheel_count)
        self.poses, self.imu, self.wheels = [pose], [], [wheels(0, angles, 0.0 * angles)]
        for index, (before, now) in enumerate(pairwise(twists), start=1):
            mean = BodyTwist(*(0.5 * (a + b) for a, b in zip(parts(before), parts(now), strict=True)))
            pose = pose.integrate(mean.vx, mean.vy, mean.wz, STEP_S)
            angles = angles + kinematics.wheel_rates(mean) * STEP_S
            self.poses.append(pose)
            ax = (now.vx - before.vx) / STEP_S - mean.wz * mean.vy
            ay = (now.vy - before.vy) / STEP_S + mean.wz * mean.vx
            gyro = (0.0, 0.0, now.wz + bias + float(spoil[index]))
            self.imu.append(ImuSample(Stamp(index * IMU_NS, index * IMU_NS, index), gyro, (ax, ay, 9.81)))
            if index % 2 == 0:
                self.wheels.append(wheels(index * IMU_NS, angles, kinematics.wheel_rates(now)))

    @property
    def end_ns(self):
        return self.imu[-1].stamp.captured_ns


def parts(twist):
    return twist.vx, twist.vy, twist.wz


STILL = [BodyTwist()] * 200


def loop(vy=0.0):
    """A square with rests, one metre and a quarter turn at a time."""
    side, turn = smooth(BodyTwist(1.0 / 1.4, vy, 0.0)), smooth(BodyTwist(0.0, 0.0, math.pi / 2.8))
    return (side + STILL + turn + STILL) * 4


@cache
def square(omni=True, bias=0.01, noise=0.002):
    return Drive(OMNI if omni else SKID, STILL + loop(0.2 if omni else 0.0), bias, noise)


def feed(odometry, imu, base, end_ns, start_ns=0):
    """Hand the samples over tick by tick, each in the tick after its arrival; return all estimates."""
    due = defaultdict(lambda: ([], []))
    for kind, samples in enumerate((imu, base)):
        for sample in samples:
            due[-(-(sample.stamp.received_ns - start_ns) // TICK_NS)][kind].append(sample)
    ticks = enumerate(range(start_ns, end_ns + TICK_NS, TICK_NS))
    return [odometry.update(sensed(tick_ns, imu=due[tick][0], base=due[tick][1])) for tick, tick_ns in ticks]


def run(odometry, drive):
    return feed(odometry, drive.imu, drive.wheels, drive.end_ns)


def assert_near(pose, expected, metres, radians):
    assert pose.distance(expected) < metres
    assert abs(math.remainder(pose.yaw - expected.yaw, math.tau)) < radians


def assert_same(one, other):
    assert one.odom_from_base == other.odom_from_base
    assert one.twist == other.twist
    assert np.array_equal(one.covariance, other.covariance)


@pytest.mark.parametrize("omni", [True, False])
def test_a_closed_loop_comes_home_and_the_gyros_bias_is_found(omni):
    drive = square(omni)
    odometry = ekf(OMNI if omni else SKID)
    estimates = run(odometry, drive)
    assert not any(estimate.faults or estimate.slipping or estimate.dropped for estimate in estimates)
    assert_near(estimates[-1].odom_from_base, drive.poses[-1], 0.01, math.radians(0.2))
    assert abs(np.mean([e.twist.wz for e in estimates[-15:]])) < 2e-3  # the gyro says 0.01


@pytest.mark.parametrize(("kinematics", "vy"), [(OMNI, 0.2), (SKID, 0.0)])
def test_without_an_inertial_unit_exact_wheels_close_a_loop_exactly(kinematics, vy):
    drive = Drive(kinematics, loop(vy))
    estimates = feed(ekf(kinematics), (), drive.wheels, drive.end_ns)
    # Two IMU periods make one wheel period, so the arc of the mean twist is not quite the way.
    assert_near(estimates[-1].odom_from_base, drive.poses[-1], 1e-4, 1e-9)
    assert estimates[-1].faults == ()


def test_the_error_is_within_its_covariance():
    errors = []
    for seed in range(6):
        drive = Drive(OMNI, STILL + loop()[:900], bias=0.005, noise=0.002, seed=seed)
        estimate = run(ekf(), drive)[-1]
        error = drive.poses[-1].inverse() @ estimate.odom_from_base
        vector = np.array((error.x, error.y, error.yaw))
        errors.append(vector @ np.linalg.solve(estimate.covariance, vector))
    assert max(errors) < 16.3  # chi-square with 3 degrees of freedom, 99.9 %


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10_000), latest_ms=st.integers(1, 200))
def test_late_and_disordered_samples_give_the_same_as_ordered_ones(seed, latest_ms):
    drive = Drive(OMNI, STILL[:60] + loop(0.1)[:400], bias=0.01, noise=0.002)
    random = np.random.default_rng(seed)

    def late(sample):
        return replace(
            sample, stamp=replace(sample.stamp, received_ns=sample.stamp.captured_ns + int(random.integers(0, latest_ms) * MS))
        )

    end_ns = drive.end_ns + 250 * MS
    ordered, disordered = ekf(), ekf()
    one = feed(ordered, drive.imu, drive.wheels, end_ns)[-1]
    imu, base = ([late(s) for s in samples] for samples in (drive.imu, drive.wheels))
    order = random.permutation(len(imu))
    other = feed(disordered, [imu[i] for i in order], base[::-1], end_ns)[-1]
    assert_same(one, other)
    assert ordered.pose_at(drive.end_ns - 333 * MS) == disordered.pose_at(drive.end_ns - 333 * MS)
    assert one.dropped == other.dropped == 0


def test_a_sample_that_is_too_late_or_comes_twice_is_dropped_and_counted():
    drive = square()
    odometry = ekf()
    feed(odometry, drive.imu[:300], drive.wheels[:150], 1500 * MS)
    before = odometry.update(sensed(1550 * MS))
    again = odometry.update(sensed(1600 * MS, imu=drive.imu[295:297], base=drive.wheels[40:41]))
    assert again.faults == (EstimatorFault.INVALID_INPUT,)
    assert again.dropped == 3
    assert np.array_equal(again.covariance, before.covariance)


def spinning(drive, first, last, extra_rad):
    """The wheels turn on while the base does not."""
    return [
        replace(s, position_rad=s.position_rad + extra_rad * min(max(i - first, 0), last - first))
        for i, s in enumerate(drive.wheels)
    ]


@pytest.mark.parametrize("extra_rad", [0.08, -0.08])  # 0.4 m/s of a wheel: they spin, or stall
def test_slip_and_stall_are_flagged_and_move_nothing(extra_rad):
    drive = Drive(SKID, STILL + smooth(BodyTwist(0.4, 0.0, 0.0), hold_s=4.0) + STILL, bias=0.004, noise=0.002)
    slipped = spinning(drive, 200, 280, extra_rad)
    estimates = feed(ekf(SKID), drive.imu, slipped, drive.end_ns)
    flagged = [index * TICK_NS for index, estimate in enumerate(estimates) if estimate.slipping]
    assert min(flagged) <= 2100 * MS
    assert max(flagged) <= 3000 * MS
    assert len(flagged) > 10
    assert estimates[-1].odom_from_base.distance(drive.poses[-1]) < 0.1
    assert 80 * abs(extra_rad) * 0.098 > 0.6  # what dead reckoning is wrong by


BAD_WHEELS = {
    "not a number": lambda s: replace(s, position_rad=s.position_rad * math.nan),
    "infinite rate": lambda s: replace(s, velocity_rad_s=s.velocity_rad_s + math.inf),
    "a wheel missing": lambda s: replace(s, position_rad=s.position_rad[1:], velocity_rad_s=s.velocity_rad_s[1:]),
    "a jump": lambda s: replace(s, position_rad=s.position_rad + 1e4),
    "from the future": lambda s: replace(s, stamp=replace(s.stamp, captured_ns=10**12)),
    "from long ago": lambda s: replace(s, stamp=replace(s.stamp, captured_ns=-(10**15))),
}
BAD_IMU = {
    "not a number": lambda s: replace(s, gyro_rad_s=(0.0, 0.0, math.nan)),
    "force not a number": lambda s: replace(s, accel_m_s2=(math.nan, 0.0, 9.81)),
    "force in g": lambda s: replace(s, accel_m_s2=tuple(v / 9.81 for v in s.accel_m_s2)),
    "force in mg": lambda s: replace(s, accel_m_s2=tuple(v / 9.81e-3 for v in s.accel_m_s2)),
}


@pytest.mark.parametrize(
    ("kind", "spoil"), [*(("wheels", f) for f in BAD_WHEELS.values()), *(("imu", f) for f in BAD_IMU.values())]
)
def test_a_bad_sample_is_dropped_counted_and_harms_nothing(kind, spoil):
    drive = square()
    samples = {"imu": list(drive.imu), "wheels": list(drive.wheels)}
    for index in (150, 151, 390):
        samples[kind][index] = spoil(samples[kind][index])
    estimates = feed(ekf(), samples["imu"], samples["wheels"], drive.end_ns)
    flagged = [index for index, estimate in enumerate(estimates) if estimate.faults]
    assert flagged
    assert all(estimates[index].faults == (EstimatorFault.INVALID_INPUT,) for index in flagged)
    assert estimates[-1].dropped >= 3
    assert_near(estimates[-1].odom_from_base, drive.poses[-1], 0.02, math.radians(0.3))


@pytest.mark.parametrize("turns", [1, 1000])
def test_a_counter_that_wraps_costs_one_interval(turns):
    drive = square()
    wrapped = [s if i < 500 else replace(s, position_rad=s.position_rad - turns * math.tau) for i, s in enumerate(drive.wheels)]
    estimates = feed(ekf(), drive.imu, wrapped, drive.end_ns)
    assert estimates[-1].dropped == 1
    assert_near(estimates[-1].odom_from_base, drive.poses[-1], 0.02, math.radians(0.3))


def test_a_gyro_in_degrees_is_dropped_or_diverges_but_never_believed():
    drive = square()
    degrees = [replace(s, gyro_rad_s=tuple(math.degrees(v) for v in s.gyro_rad_s)) for s in drive.imu]
    estimates = feed(ekf(), degrees, drive.wheels, drive.end_ns)
    assert any(EstimatorFault.DIVERGED in estimate.faults for estimate in estimates)
    assert all(math.isfinite(estimate.odom_from_base.x) for estimate in estimates)


def test_wheels_that_contradict_the_inertial_unit_for_long_are_divergence_and_then_believed():
    drive = square()
    stuck = [replace(s, gyro_rad_s=(0.0, 0.0, 1.5)) for s in drive.imu]
    estimates = feed(ekf(ekf={"diverged_after_s": 0.5, "gyro_bias_max_rad_s": 5.0}), stuck, drive.wheels, 4000 * MS)
    assert any(estimate.faults == (EstimatorFault.DIVERGED,) for estimate in estimates)
    assert all(np.isfinite(estimate.covariance).all() for estimate in estimates)


def offset(drive, x_m, y_m):
    """The same drive with the inertial unit away from the base's origin: what a point there of a rigid body feels."""
    rates = [0.0, *(s.gyro_rad_s[2] for s in drive.imu)]
    moved = []
    for before, sample in zip(rates, drive.imu, strict=False):
        rate = sample.gyro_rad_s[2]
        spin, turning = (rate - before) / STEP_S, 0.5 * (rate + before)
        fx, fy, fz = sample.accel_m_s2
        moved.append(replace(sample, accel_m_s2=(fx - turning**2 * x_m - spin * y_m, fy - turning**2 * y_m + spin * x_m, fz)))
    return moved


def test_the_place_of_the_inertial_unit_is_taken_into_account():
    turns = [BodyTwist(0.0, 0.0, 2.0 * math.sin(0.02 * i)) for i in range(800)]
    drive = Drive(OMNI, STILL + turns)
    away = offset(drive, 0.3, -0.2)

    def worst(imu_in_base_m):
        # Few wheel samples, or they would outweigh what the accelerometer says.
        odometry = build_odometry(OdometrySettings(kind="ekf"), OMNI, imu_in_base_m)
        estimates = feed(odometry, away, drive.wheels[::20], drive.end_ns)
        return max(math.hypot(e.twist.vx, e.twist.vy) for e in estimates)

    assert worst((0.3, -0.2)) < 0.2 * worst((0.0, 0.0))


def test_ten_minutes_of_standing_and_driving_does_not_diverge_and_a_broken_gyro_does():
    """Sparse samples spare time.  What grows without bound, the variance of the position, is no divergence."""
    odometry, angles, pose = ekf(), np.zeros(3), SE2()
    odometry.warm_up()
    tick_ns = 200 * MS
    for tick in range(1, 5 * 600):
        twist = BodyTwist(0.2, 0.0, 0.3) if (tick // 100) % 2 else BodyTwist()
        pose, angles = pose.integrate(twist.vx, 0.0, twist.wz, 0.2), angles + 0.2 * OMNI.wheel_rates(twist)
        force = (0.0, twist.wz * twist.vx, 9.81)
        times = range((tick - 1) * tick_ns + 40 * MS, tick * tick_ns + 1, 40 * MS)
        imu = [ImuSample(Stamp(at, at, 0), (0.0, 0.0, twist.wz + 0.004), force) for at in times]
        base = [wheels(tick * tick_ns, angles, OMNI.wheel_rates(twist))]
        estimate = odometry.update(sensed(tick * tick_ns, imu=imu, base=base))
        assert EstimatorFault.DIVERGED not in estimate.faults
    assert abs(math.remainder(estimate.odom_from_base.yaw - pose.yaw, math.tau)) < 0.1
    assert estimate.covariance[0, 0] > 1e-4
    broken = []
    for at in range(tick * tick_ns + 40 * MS, (tick + 50) * tick_ns, 40 * MS):
        imu = [ImuSample(Stamp(at, at, 0), (0.0, 0.0, 3.0), (0.0, 0.0, 9.81))]
        broken += odometry.update(sensed(at, imu=imu, base=[wheels(at, angles, 0.0 * angles)])).faults
    assert EstimatorFault.DIVERGED in broken


def test_silence_is_survived_and_costs_certainty():
    drive = square()
    odometry = ekf()
    before = feed(odometry, drive.imu[:400], drive.wheels[:200], 2000 * MS)[-1]
    after = feed(odometry, drive.imu[800:], drive.wheels[400:], drive.end_ns, 2050 * MS)[-1]
    assert after.covariance[0, 0] > before.covariance[0, 0] + 0.1
    assert np.linalg.eigvalsh(after.covariance).min() > 0.0
    assert after.faults == ()


def test_absolute_poses_tie_the_estimate_down():
    drive = Drive(SKID, STILL + smooth(BodyTwist(0.5, 0.0, 0.0), hold_s=10.0), bias=0.0)
    wrong = [replace(s, position_rad=s.position_rad * 1.05, velocity_rad_s=s.velocity_rad_s * 1.05) for s in drive.wheels]
    local_from_odom = SE2(10.0, -5.0, 1.1)
    covariance = np.diag((0.01**2, 0.01**2, 0.005**2))
    absolute = [
        PoseSample(Stamp(i * IMU_NS, i * IMU_NS, i), local_from_odom @ drive.poses[i], None, covariance)
        for i in range(0, 2300, 20)
    ]
    tied = feed(ekf(SKID), drive.imu, [*wrong, *absolute], drive.end_ns)[-1]
    free = feed(ekf(SKID), drive.imu, wrong, drive.end_ns)[-1]
    assert tied.odom_from_base.distance(drive.poses[-1]) < 0.03
    assert free.odom_from_base.distance(drive.poses[-1]) > 0.15
    bad = replace(absolute[-1], stamp=Stamp(drive.end_ns + MS, drive.end_ns + MS, 0), covariance=covariance * math.nan)
    odometry = ekf(SKID)
    feed(odometry, drive.imu, drive.wheels, drive.end_ns)
    assert odometry.update(sensed(drive.end_ns + 100 * MS, base=[bad])).faults == (EstimatorFault.INVALID_INPUT,)


def test_a_device_with_poses_only_is_followed():
    start = SE2(12.0, -7.0, 2.0)
    twist = BodyTwist(0.5, 0.0, 0.3)
    poses = [
        PoseSample(Stamp(i * 100 * MS, i * 100 * MS, i), start.integrate(0.5, 0.0, 0.3, 0.1 * i), twist, np.eye(3) * 1e-6)
        for i in range(40)
    ]
    estimate = feed(ekf(None), (), poses, 3900 * MS)[-1]
    assert_near(estimate.odom_from_base, SE2().integrate(0.5, 0.0, 0.3, 3.95), 0.05, 0.02)


def test_wheels_without_kinematics_are_flagged():
    assert ekf(None).update(sensed(0, base=[wheels(0, [0.0], [0.0])])).faults == (EstimatorFault.INVALID_INPUT,)


def test_a_restored_odometry_goes_on_identically():
    drive = square()
    first, second = ekf(), ekf()
    absolute = PoseSample(Stamp(1495 * MS, 1495 * MS, 0), SE2(1.0, 2.0, 3.0), None, np.eye(3) * 1e-3)
    feed(first, drive.imu[:310], [*drive.wheels[:150], absolute], 1500 * MS)
    second.restore(first.snapshot())
    assert first.snapshot() == second.snapshot()
    assert first.pose_at(1200 * MS) == second.pose_at(1200 * MS)
    rest = (drive.imu[310:], drive.wheels[150:], 2500 * MS, 1550 * MS)
    for one, other in zip(feed(first, *rest), feed(second, *rest), strict=True):
        assert_same(one, other)
        assert one.dropped == other.dropped
    assert first.snapshot() == second.snapshot()


def test_the_past_that_is_kept_is_bounded():
    drive = square()
    odometry = ekf()
    feed(odometry, drive.imu[:600], drive.wheels[:300], 3000 * MS)
    early = len(odometry.snapshot())
    feed(odometry, drive.imu[600:2400], drive.wheels[300:1200], 12_000 * MS, 3050 * MS)
    assert len(odometry.snapshot()) <= 1.05 * early


finite = st.floats(-2.0, 2.0)


@given(x=st.lists(finite, min_size=STATES, max_size=STATES), rate=finite, force=st.tuples(finite, finite))
def test_the_jacobian_is_that_of_the_motion(x, rate, force):
    inertial, dt_s, step = Inertial(rate, *force, True, 0.01, 0.1), 0.01, 1e-6
    state = np.array(x)
    _, jacobian = moved(state, inertial, dt_s)
    for column in range(STATES):
        nudge = step * np.eye(STATES)[column]
        slope = (moved(state + nudge, inertial, dt_s)[0] - moved(state - nudge, inertial, dt_s)[0]) / (2.0 * step)
        np.testing.assert_allclose(jacobian[:, column], slope, atol=4e-4)  # terms of third order in time are left out


@given(x=st.lists(finite, min_size=STATES, max_size=STATES), rate=finite)
def test_process_noise_is_a_covariance(x, rate):
    for known in (True, False):
        _, _, noise = transition(np.array(x), (rate, 0.3, 0.1, known, 0.01, 0.1), np.array((1e-5, 1e-3, 1e-3)), 0.005)
        assert np.array_equal(noise, noise.T)
        assert np.linalg.eigvalsh(noise).min() > -1e-15


def test_calibrated_geometry_takes_the_place_of_the_bases_own():
    nominal = {"wheel_distance_m": OMNI.wheel_distance_m, "wheel_bearing_rad": OMNI.wheel_bearing_rad}
    geometry = {"kind": "omni", "wheel_radius_m": (0.06,) * 3} | nominal
    turned = [WheelSample(Stamp(i * 10 * MS, 0, i), *(np.full(3, 0.01 * i), np.ones(3))) for i in range(11)]
    for kind in ("dead_reckoning", "ekf"):
        odometry = build_odometry(OdometrySettings(kind=kind, geometry=geometry), OMNI)
        assert odometry.update(sensed(100 * MS, base=turned)).odom_from_base.yaw == pytest.approx(0.1 * 0.06 / 0.1)
