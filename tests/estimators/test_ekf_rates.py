"""The Kalman filter of the odometry with an inertial unit of any rate: what lies between its samples is reckoned with."""

import math

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.kinematics import SkidSteer
from drivers.interface.samples import ImuSample, Stamp
from drivers.interface.seeds import stream
from estimators.odometry.ekf_filter import MotionFilter
from estimators.odometry.ekf_model import VX, VY, YAW
from estimators.odometry.ekf_settings import EkfSettings
from estimators.odometry.odometry_choice import OdometrySettings, build_odometry
from estimators.odometry.odometry_limits import MotionLimits
from tests.estimators.scenes import MS, sensed, wheels

SKID = SkidSteer(wheel_radius_m=0.098, effective_track_m=0.56, wheel_count=2)
STEP_S = 1e-3
LAG_S, BRAKE_M_S2, TURN_RAD_S2 = 0.06, 2.0, 6.0
# What is asked of a base, and until when [s]: it spins, drives off, brakes, drives a curve, spins the other way, stops.
ASKED = ((0.5, 0.0, 0.0), (2.0, 0.0, 1.8), (2.6, 0.0, 0.0), (4.0, 0.9, 0.0), (5.5, 0.5, 1.5), (7.0, 0.0, -1.8), (8.0, 0.0, 0.0))


class Motion:
    """A base that follows what is asked along ramps and with a lag, each millisecond, and that shakes."""

    def __init__(self, seed, shaking_m_s2=0.0, offset_s=0.0):
        self.random = stream(seed, "rates")
        times = np.arange(0.0, ASKED[-1][0], STEP_S)
        asked = np.array([next(twist for end, *twist in ASKED if time < end) for time in np.maximum(times - offset_s, 0.0)])
        ramp = np.array((BRAKE_M_S2, TURN_RAD_S2)) * STEP_S
        twists, along, now = [], np.zeros(2), np.zeros(2)
        for target in asked:
            along = along + np.clip(target - along, -ramp, ramp)
            now = now + (along - now) * STEP_S / LAG_S
            twists.append(now)
        self.v, self.w = np.array(twists).T
        yaw = np.concatenate(((0.0,), np.cumsum(0.5 * (self.w[1:] + self.w[:-1]) * STEP_S)))
        speed, half = 0.5 * (self.v[1:] + self.v[:-1]), 0.5 * (yaw[1:] + yaw[:-1])
        x, y = (np.concatenate(((0.0,), np.cumsum(speed * f(half) * STEP_S))) for f in (np.cos, np.sin))
        self.poses = np.stack((x, y, yaw), axis=1)
        force = np.stack((np.gradient(self.v, STEP_S), self.v * self.w), axis=1)
        self.force = force + shaking_m_s2 * self.random.standard_normal(force.shape)

    def imu(self, rate_hz):
        """The unit takes what is there at the moment: what it does not sample, it does not see."""
        rows = range(0, len(self.v), round(1.0 / rate_hz / STEP_S))
        for sequence, row in enumerate(rows):
            gyro, noise = self.w[row], self.random.standard_normal() * 2.4e-4 * math.sqrt(rate_hz / 2.0)
            stamp = Stamp(row * MS, row * MS, sequence)
            yield ImuSample(stamp, (0.0, 0.0, float(gyro + noise)), (*self.force[row].tolist(), 9.81))

    def wheels(self, every_ms, first_ms):
        turned = np.zeros(2)
        rates = np.array([SKID.wheel_rates(BodyTwist(v, 0.0, w)) for v, w in zip(self.v, self.w, strict=True)])
        angles = np.concatenate((turned[None], np.cumsum(0.5 * (rates[1:] + rates[:-1]) * STEP_S, axis=0)))
        return [wheels(row * MS, angles[row], rates[row]) for row in range(first_ms, len(self.v), every_ms)]


@pytest.mark.parametrize("shaking_m_s2", [0.0, 1.0])
@pytest.mark.parametrize("rate_hz", [25, 200])
def test_what_the_inertial_unit_alone_says_is_wrong_by_no_more_than_it_is_said_to_be(rate_hz, shaking_m_s2):
    """Squared errors of yaw and velocity, normalised by their covariance: 3 in the mean, and less where the motion is smooth."""
    certain = EkfSettings(gyro_bias_std_rad_s=1e-9, accel_bias_std_m_s2=1e-9, accel_noise_m_s2_sqrt_hz=3e-3)
    part, found = [YAW, VX, VY], []
    for seed in range(6):
        motion = Motion(seed, shaking_m_s2, offset_s=0.007 * seed)
        filtering = MotionFilter(certain, MotionLimits(3.0, 6.0), None)
        state = filtering.start()
        covariance = state.covariance.copy()
        covariance[part, part] = 1e-12
        state = state._replace(covariance=covariance)
        for sample in motion.imu(rate_hz):
            state = filtering.fold(state, sample)
            row = sample.stamp.captured_ns // MS
            if row % 1000 == 0 and row > 0:
                error = state.x[part] - (motion.poses[row, 2], motion.v[row], 0.0)
                found.append(error @ np.linalg.solve(state.covariance[np.ix_(part, part)], error))
    assert np.mean(found) < 3.5
    assert np.max(found) < 16.3  # chi-square with 3 degrees of freedom, 99.9 %
    if shaking_m_s2 > 0.0:
        assert np.mean(found) > 0.8  # and it is no blank cheque


@pytest.mark.parametrize("rate_hz", [25, 200])
def test_a_spin_that_shakes_the_base_is_no_slip_of_its_wheels(rate_hz):
    """The wheels of a 25 Hz wire, half an interval off its inertial unit's, while the base spins, brakes and shakes."""
    motion = Motion(3, shaking_m_s2=1.0)
    odometry = build_odometry(OdometrySettings(kind="ekf"), SKID)
    imu, base = list(motion.imu(rate_hz)), motion.wheels(40, 20)
    for end_ms in range(50, len(motion.v), 50):
        due = [[s for s in samples if (end_ms - 50) * MS < s.stamp.captured_ns <= end_ms * MS] for samples in (imu, base)]
        estimate = odometry.update(sensed(end_ms * MS, imu=due[0], base=due[1]))
        assert not estimate.slipping
        assert estimate.faults == ()
        x, y, yaw = motion.poses[min(end_ms, len(motion.poses) - 1)]
        assert estimate.odom_from_base.distance(SE2(x, y, yaw)) < 0.06
        assert abs(estimate.odom_from_base.yaw - math.remainder(yaw, math.tau)) < math.radians(2.0)
