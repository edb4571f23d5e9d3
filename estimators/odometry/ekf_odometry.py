"""Odometry by an extended Kalman filter over wheels, inertial unit and absolute poses, each at its own capture time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.kinematics import WheelKinematics
from drivers.interface.samples import BaseSample, PoseSample, frozen_array
from drivers.interface.sensed import Sensed
from drivers.interface.stateful import pack, unpack
from estimators.belief import EstimatorFault
from estimators.odometry.ekf_filter import MotionFilter, Sample
from estimators.odometry.ekf_history import History
from estimators.odometry.ekf_model import GYRO_BIAS, POSE
from estimators.odometry.ekf_samples import pack_samples, unpack_samples
from estimators.odometry.ekf_settings import EkfSettings
from estimators.odometry.ekf_state import EkfState
from estimators.odometry.odometry import SECOND_NS, OdometryEstimate, PoseTrail, latest_valid_ns
from estimators.odometry.odometry_limits import MotionLimits


class EkfOdometry:
    """Odometry that a gyro drives, that wheels correct and that absolute poses tie down.

    A late sample is folded in where it belongs, if it is not later than `late_max_s`; the estimate is then the same, bit for
    bit, as if it had come in time.  A sample that cannot be used is dropped, counted and a fault of its tick.
    """

    def __init__(
        self,
        settings: EkfSettings,
        limits: MotionLimits,
        kinematics: WheelKinematics | None,
        *,
        trail_s: float,
        extrapolation_max_s: float,
    ) -> None:
        """Begin at the identity; keep `trail_s` of the past, and believe the last twist for `extrapolation_max_s`."""
        self._motion = MotionFilter(settings, limits, kinematics)
        self._late_max_ns = round(settings.late_max_s * SECOND_NS)
        span_s = max(trail_s, settings.late_max_s)
        self._history = History(self._motion, round(span_s * SECOND_NS))
        self._wheels_late_ns = round(limits.wheels_late_s * SECOND_NS)
        self._trail = PoseTrail(span_s, extrapolation_max_s)
        self._refused = 0  # samples that came too late, too early or twice

    def warm_up(self) -> None:
        """Compile the motion model; what is believed stays as it is."""
        self._motion.warm_up()

    def update(self, sensed: Sensed) -> OdometryEstimate:
        """Fold in every sample at its own capture time, then carry the last twist on to the tick."""
        before, refused_before = self._history.newest, self._refused
        samples: tuple[Sample, ...] = (*sensed.imu, *(self._on_time(sample) for sample in sensed.base))
        tick, latest_ns = sensed.tick, latest_valid_ns(sensed)
        earliest_ns = tick.start_ns - tick.skipped * tick.period_ns - self._late_max_ns  # a late loop does not make a sample late
        if before.time_ns is None:  # what was measured before the first tick is no fault of the device
            samples = tuple(sample for sample in samples if sample.stamp.captured_ns >= earliest_ns)
        timely = [sample for sample in samples if earliest_ns <= sample.stamp.captured_ns <= latest_ns]
        first, repeated = self._history.insert(timely)
        self._refused += len(samples) - len(timely) + repeated
        self._retrace(first)
        self._history.forget()
        state = self._history.newest
        dropped = state.dropped > before.dropped or self._refused > refused_before
        return self._estimate(sensed.tick.start_ns, state, _faults(state.diverged > before.diverged, dropped))

    def pose_at(self, time_ns: int) -> SE2:
        """Return odom_from_base at a time of the recent past."""
        return self._trail.at(time_ns)

    def _on_time(self, sample: BaseSample) -> BaseSample:
        """Return a wheel sample with the stamp that it should have borne, as calibration found out."""
        if self._wheels_late_ns == 0 or isinstance(sample, PoseSample):
            return sample
        stamp = replace(sample.stamp, captured_ns=sample.stamp.captured_ns - self._wheels_late_ns)
        return replace(sample, stamp=stamp)

    def _estimate(self, start_ns: int, state: EkfState, faults: tuple[EstimatorFault, ...]) -> OdometryEstimate:
        covariance = frozen_array(state.covariance[POSE, POSE].copy())
        dropped, pose = state.dropped + self._refused, self._trail.at(start_ns)
        return OdometryEstimate(pose, self._trail.twist, covariance, state.time_ns, faults, state.slipping, dropped)

    def _retrace(self, first: int) -> None:
        """Lay the trail along the states from a place on."""
        for state in self._history.states[first:]:
            if state.time_ns is not None:
                self._trail.rewind(state.time_ns)
                self._trail.append(state.time_ns, state.pose, _twist(state))

    def snapshot(self) -> bytes:
        """Return the whole state: the oldest state of the window and the samples since, from which all others follow."""
        return pack(
            base=np.frombuffer(self._history.base.packed(), dtype=np.uint8),
            refused=self._refused,
            samples=np.frombuffer(pack_samples(self._history.samples), dtype=np.uint8),
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        content = unpack(snapshot)
        self._refused = int(content["refused"])
        base = EkfState.unpacked(content["base"].tobytes())
        self._history.restore(base, unpack_samples(content["samples"].tobytes()))
        self._trail.rewind(-(2**63))
        if base.time_ns is not None:
            self._trail.append(base.time_ns, base.pose, _twist(base))
        self._retrace(0)


def _faults(diverged: bool, dropped: bool) -> tuple[EstimatorFault, ...]:
    found = ((diverged, EstimatorFault.DIVERGED), (dropped, EstimatorFault.INVALID_INPUT))
    return tuple(fault for present, fault in found if present)


def _twist(state: EkfState) -> BodyTwist:
    vx, vy = state.velocity_m_s
    return BodyTwist(vx, vy, state.rate_rad_s - float(state.x[GYRO_BIAS]))
