"""How one sample changes what the odometry's extended Kalman filter knows: inertial unit, wheels, absolute pose."""

from __future__ import annotations

import math

import numpy as np

from drivers.interface.geometry import wrap_angle
from drivers.interface.kinematics import WheelKinematics
from drivers.interface.samples import ImuSample, PoseSample, WheelSample
from estimators.odometry.ekf_algebra import Algebra, squared_surprise
from estimators.odometry.ekf_inertial import InertialModel, Reading
from estimators.odometry.ekf_model import BIASES, GYRO_BIAS, POSE, STATES, VELOCITY, VX, WAY, YAW, transition, without_way
from estimators.odometry.ekf_settings import EkfSettings
from estimators.odometry.ekf_state import EkfState
from estimators.odometry.odometry import SECOND_NS, STAMP_SLACK_S
from estimators.odometry.odometry_limits import MotionLimits
from estimators.odometry.wheel_way import WheelModel, WheelWay, farthest

Sample = ImuSample | WheelSample | PoseSample
VELOCITY_STD_M_S = 0.5  # of a velocity of which nothing is known
LOST_STD = (0.5, 0.5, 0.5)  # m, m, rad: what the pose loses while nothing is sensed for too long
IMPOSSIBLE = 2.0  # times the fastest: a velocity that no shock explains either


class MotionFilter:
    """Folds samples into states, in the order of their capture times; bad ones are counted in the state and change no more."""

    def __init__(self, settings: EkfSettings, limits: MotionLimits, kinematics: WheelKinematics | None) -> None:
        """Without kinematics wheel samples are of no use."""
        self._settings, self._limits = settings, limits
        self._wheels = None if kinematics is None else WheelModel(settings, kinematics)
        self._inertial = InertialModel(settings, limits)
        self._algebra = Algebra(settings.innovation_gate, settings.skip_ratio)
        s = settings
        self._walk_std = np.array((s.gyro_walk_rad_s2_sqrt_hz, s.accel_walk_m_s3_sqrt_hz, s.accel_walk_m_s3_sqrt_hz))
        self._prior = np.zeros(STATES)  # variances at the start
        self._prior[VELOCITY] = VELOCITY_STD_M_S**2
        self._prior[BIASES] = s.gyro_bias_std_rad_s**2, s.accel_bias_std_m_s2**2, s.accel_bias_std_m_s2**2

    def start(self) -> EkfState:
        """Return the state before any sample: at the identity of odom."""
        x = np.zeros(STATES)
        x[GYRO_BIAS] = self._limits.gyro_bias_rad_s
        return EkfState(x, np.diag(self._prior))

    def warm_up(self) -> None:
        """Compile the motion model and the gate."""
        squared_surprise(np.zeros(3), np.eye(STATES), POSE.start, np.eye(3))
        without_way(np.zeros(STATES), np.eye(STATES))
        farthest(np.zeros(3), np.zeros(3))
        self._algebra.warm_up()
        if self._wheels is not None:
            self._wheels.warm_up()
        transition(np.zeros(STATES), (0.0, 0.0, 0.0, True, 1.0, 1.0), self._walk_std, 0.01)

    def fold(self, state: EkfState, sample: Sample, ahead: ImuSample | None = None) -> EkfState:
        """Return the state after a sample that was captured no earlier than the state; `ahead` is the inertial one after it."""
        match sample:
            case ImuSample():
                after = self._fold_inertial(state, sample)
            case WheelSample():
                after = self._fold_wheels(state, sample, self._next(state, ahead))
            case PoseSample():
                after = self._fold_pose(state, sample, self._next(state, ahead))
        return self._checked(state, after, sample.stamp.captured_ns)

    def _fold_inertial(self, state: EkfState, sample: ImuSample) -> EkfState:
        reading = self._inertial.reading(state, sample)
        if reading is None:
            return state._replace(dropped=state.dropped + 1)
        return self._inertial.taken(self._to(state, reading.captured_ns, reading), reading)

    def _next(self, state: EkfState, ahead: ImuSample | None) -> Reading | None:
        """Return the next reading where it is near enough to say something of the time before it."""
        near = ahead is not None and self._inertial.recent(state, ahead.stamp.captured_ns)
        return self._inertial.reading(state, ahead) if near and ahead is not None else None

    def _fold_wheels(self, state: EkfState, sample: WheelSample, ahead: Reading | None) -> EkfState:
        model, captured_ns = self._wheels, sample.stamp.captured_ns
        if model is None or not model.usable(sample):
            return state._replace(dropped=state.dropped + 1)
        if state.wheels_ns is None or state.wheels_rad is None:
            return self._anchored(self._to(state, captured_ns, ahead), sample)
        elapsed_s = (captured_ns - state.wheels_ns) / SECOND_NS
        way = model.way(state.wheels_rad, sample, elapsed_s)
        if not self._plausible(way, elapsed_s):  # a counter jumped, wrapped or was reset
            after = self._anchored(self._to(state, captured_ns, ahead), sample)
            return after._replace(dropped=state.dropped + 1)
        if state.time_ns == state.wheels_ns and not self._inertial.recent(state, captured_ns):
            return self._anchored(self._reckoned(state, way, captured_ns), sample)
        after = self._to(state, captured_ns, ahead)
        if after.wheels_ns is not None:
            if self._stands(state, sample):
                way = model.standstill()
            lost = elapsed_s > self._settings.gap_max_s and after.covariance[VX, VX] > self._settings.speed_unknown_std_m_s**2
            after = self._gated(after, way, captured_ns)
            after = self._at_speed(after, way) if lost or self._is_too_fast(after) else after
        return self._anchored(after, sample)

    def _fold_pose(self, state: EkfState, sample: PoseSample, ahead: Reading | None) -> EkfState:
        """Fold in an absolute pose; the first one says where the device's own frame lies."""
        pose, covariance, s = sample.local_from_base, sample.covariance, self._settings
        finite = math.isfinite(pose.x + pose.y + pose.yaw) and covariance.shape == (3, 3) and np.isfinite(covariance).all()
        if not finite or (np.diag(covariance) < 0.0).any():
            return state._replace(dropped=state.dropped + 1)
        if sample.twist is not None and sample.twist.finite and not self._inertial.recent(state, sample.stamp.captured_ns):
            state = state._replace(rate_rad_s=sample.twist.wz + float(state.x[GYRO_BIAS]))
        before = self._to(state, sample.stamp.captured_ns, ahead)
        if before.local_from_odom is None:
            return before._replace(local_from_odom=pose @ before.pose.inverse())
        measured, believed = before.local_from_odom.inverse() @ pose, before.pose
        innovation = np.array((measured.x - believed.x, measured.y - believed.y, wrap_angle(measured.yaw - believed.yaw)))
        c, sn = math.cos(before.local_from_odom.yaw), math.sin(before.local_from_odom.yaw)
        odom_from_local = np.array(((c, sn, 0.0), (-sn, c, 0.0), (0.0, 0.0, 1.0)))
        floor = np.diag((s.pose_std_min_m**2, s.pose_std_min_m**2, s.yaw_std_min_rad**2))
        noise = odom_from_local @ (0.5 * (covariance + covariance.T)) @ odom_from_local.T + floor
        weight = self._algebra.weight(before, innovation, POSE, noise)
        if weight == 0.0:
            return before._replace(dropped=before.dropped + 1)
        x, covariance = self._algebra.correct(before, innovation, POSE, noise / weight)
        return before._replace(x=x, covariance=covariance)

    def _plausible(self, way: WheelWay, elapsed_s: float) -> bool:
        speed_max, rate_max = self._limits.speed_max_m_s, self._limits.turn_rate_max_rad_s
        (dx, dy, turned), (vx, vy, wz) = way.vector.tolist(), way.twist.tolist()
        longest_s = elapsed_s + STAMP_SLACK_S
        moves = math.hypot(dx, dy) <= speed_max * longest_s and abs(turned) <= rate_max * longest_s
        return moves and math.hypot(vx, vy) <= speed_max and abs(wz) <= rate_max

    def _to(self, state: EkfState, time_ns: int, ahead: Reading | None) -> EkfState:
        """Carry a state on, by what the inertial unit says before and after; where it said nothing after, its last holds."""
        if state.time_ns is None or time_ns == state.time_ns:
            return state._replace(time_ns=time_ns)
        dt_s = (time_ns - state.time_ns) / SECOND_NS
        if dt_s > self._settings.blind_max_s:
            return self._lost(state, time_ns)
        inertial = self._inertial
        drive = inertial.held(state, time_ns) if ahead is None else inertial.between(state, ahead, time_ns)
        x, covariance = self._algebra.propagate(state, *transition(state.x, drive, self._walk_std, dt_s))
        return state._replace(x=x, covariance=covariance, time_ns=time_ns)

    def _lost(self, state: EkfState, time_ns: int) -> EkfState:
        """Go on after a time without any sample: velocity and way are unknown, and the pose is less certain."""
        x, covariance = state.x.copy(), state.covariance.copy()
        x[VELOCITY] = 0.0
        covariance[VELOCITY] = covariance[:, VELOCITY] = 0.0
        covariance[VELOCITY, VELOCITY] = np.diag(self._prior[VELOCITY])
        covariance[POSE, POSE] += np.diag(np.square(LOST_STD))
        return state._replace(x=x, covariance=covariance, time_ns=time_ns, wheels_ns=None, wheels_rad=None)

    def _anchored(self, state: EkfState, sample: WheelSample) -> EkfState:
        """Count the way anew from this sample."""
        x, covariance = without_way(state.x, state.covariance)
        captured_ns, angles = sample.stamp.captured_ns, sample.position_rad.copy()
        state = state._replace(x=x, covariance=covariance, wheels_ns=captured_ns, wheels_rad=angles)
        if state.still_rad is None:  # a robot that is switched on stands, until its wheels say otherwise
            return state._replace(still_ns=captured_ns - round(self._settings.still_after_s * SECOND_NS), still_rad=angles)
        if farthest(angles, state.still_rad) > self._settings.still_rad:
            return state._replace(still_ns=captured_ns, still_rad=angles)
        return state

    def _stands(self, state: EkfState, sample: WheelSample) -> bool:
        """Tell whether the wheels have stood for a while, and still do (zero-velocity update).

        The gyro must agree, as far as its bias is known: it notices first that a base sets off.
        """
        if state.still_ns is None or state.still_rad is None:
            return False
        s = self._settings
        bias_std = math.sqrt(float(state.covariance[GYRO_BIAS, GYRO_BIAS]))
        if abs(state.rate_rad_s - float(state.x[GYRO_BIAS])) > s.still_rate_rad_s + 3.0 * bias_std:
            return False
        return (
            sample.stamp.captured_ns - state.still_ns >= s.still_after_s * SECOND_NS
            and float(np.abs(sample.position_rad - state.still_rad).max()) <= s.still_rad
        )

    def _reckoned(self, state: EkfState, way: WheelWay, time_ns: int) -> EkfState:
        """Move by the wheels alone, where no inertial unit says anything (Thrun, Probabilistic Robotics, section 5.4)."""
        x, (dx, dy, turned) = state.x.copy(), way.vector.tolist()
        c, s = math.cos(x[YAW]), math.sin(x[YAW])
        x[POSE] += c * dx - s * dy, s * dx + c * dy, turned
        x[VELOCITY] = way.twist[:2]
        jacobian = np.eye(STATES)
        jacobian[0, YAW] = -s * dx - c * dy
        jacobian[1, YAW] = c * dx - s * dy
        jacobian[VELOCITY, VELOCITY] = 0.0
        noise = np.zeros((STATES, STATES))
        odom_from_base = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
        noise[POSE, POSE] = odom_from_base @ way.covariance @ odom_from_base.T
        noise[VELOCITY, VELOCITY] = np.eye(2) * self._settings.blind_accel_m_s2_sqrt_hz**2
        mean, covariance = self._algebra.propagate(state, x, jacobian, noise)
        rate = float(way.twist[2] + state.x[GYRO_BIAS])
        return state._replace(x=mean, covariance=covariance, time_ns=time_ns, rate_rad_s=rate, slipping=False)

    def _gated(self, state: EkfState, way: WheelWay, time_ns: int) -> EkfState:
        """Correct by the wheels as far as they agree; wheels that slip or stall do not, and are eased or left out."""
        innovation = way.vector - state.x[WAY]
        weight = self._algebra.weight(state, innovation, WAY, way.grip)
        if weight < 1.0:
            since_ns = time_ns if state.rejected_ns is None else state.rejected_ns
            if time_ns - since_ns > self._settings.diverged_after_s * SECOND_NS:
                return self._begun_anew(state, way)
            state = state._replace(slipping=True, rejected_ns=since_ns)
        else:
            state = state._replace(slipping=False, rejected_ns=None)
        if weight == 0.0:
            return state
        x, covariance = self._algebra.correct(state, innovation, WAY, way.covariance / weight)
        return state._replace(x=x, covariance=covariance)

    def _is_too_fast(self, state: EkfState, factor: float = 1.0) -> bool:
        """Whether a correction by a way whose time was wrong has left a velocity that no base has."""
        return math.hypot(*state.x[VELOCITY].tolist()) > factor * self._limits.speed_max_m_s

    def _at_speed(self, state: EkfState, way: WheelWay) -> EkfState:
        """Believe the wheels' rates for the velocity, where a gap has left it unknown.

        A way that is divided by its time would do, were the time right: if stamps or the world stood still, it is not, and the
        wheels would contradict the wrong velocity from then on.
        """
        x, covariance = state.x.copy(), state.covariance.copy()
        x[VELOCITY] = way.twist[:2]
        covariance[VELOCITY] = covariance[:, VELOCITY] = 0.0
        covariance[VELOCITY, VELOCITY] = np.eye(2) * self._settings.speed_unknown_std_m_s**2
        return state._replace(x=x, covariance=covariance)

    def _begun_anew(self, state: EkfState, way: WheelWay) -> EkfState:
        """Keep the pose, believe the wheels, and learn velocity and biases again."""
        x, covariance = state.x.copy(), np.zeros((STATES, STATES))
        x[VELOCITY], x[BIASES] = way.twist[:2], (self._limits.gyro_bias_rad_s, 0.0, 0.0)
        covariance[POSE, POSE] = state.covariance[POSE, POSE] + np.diag(np.square(LOST_STD))
        covariance += np.diag(self._prior)
        return state._replace(x=x, covariance=covariance, rejected_ns=None, diverged=state.diverged + 1)

    def _checked(self, before: EkfState, after: EkfState, time_ns: int) -> EkfState:
        """Return the state after a sample if it can be true; else one that begins anew."""
        bias, spread = float(after.x[GYRO_BIAS]) - self._limits.gyro_bias_rad_s, after.covariance.ravel()
        finite = math.isfinite(after.x.dot(after.x) + spread.dot(spread))
        if finite and abs(bias) <= self._settings.gyro_bias_max_rad_s and not self._is_too_fast(after, IMPOSSIBLE):
            return after
        fresh = self.start()
        x = fresh.x.copy()
        x[POSE] = before.x[POSE]
        covariance = fresh.covariance.copy()
        covariance[POSE, POSE] = before.covariance[POSE, POSE] + np.diag(np.square(LOST_STD))
        state = fresh._replace(x=x, covariance=covariance, time_ns=time_ns, local_from_odom=before.local_from_odom)
        return state._replace(dropped=before.dropped, diverged=before.diverged + 1)
