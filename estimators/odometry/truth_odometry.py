"""Odometry that is told the truth: for evaluation of what comes after it, chosen by the configuration only."""

from __future__ import annotations

import math

import numpy as np

from drivers.interface.geometry import SE2
from drivers.interface.samples import TruthSample, frozen_array
from drivers.interface.sensed import Sensed
from estimators.belief import EstimatorFault
from estimators.odometry.odometry import OdometryEstimate, PoseTrail, latest_valid_ns


class TruthOdometry:
    """The true motion since the start, from `TruthSample`s."""

    def __init__(self, map_from_start: SE2, trail_s: float, extrapolation_max_s: float) -> None:
        """`map_from_start` is where odom lies in the map."""
        self._start_from_map = map_from_start.inverse()
        self._trail = PoseTrail(trail_s, extrapolation_max_s)

    def warm_up(self) -> None:
        """Do nothing: there is no kernel."""

    def update(self, sensed: Sensed) -> OdometryEstimate:
        """Take over the newest truth, carried on to the tick."""
        valid = sensed.truth is None or self._fold(sensed.truth, latest_valid_ns(sensed))
        faults = () if valid else (EstimatorFault.INVALID_INPUT,)
        pose, covariance = self._trail.at(sensed.tick.start_ns), frozen_array(np.zeros((3, 3)))
        return OdometryEstimate(pose, self._trail.twist, covariance, self._trail.newest_ns, faults)

    def pose_at(self, time_ns: int) -> SE2:
        """Return odom_from_base at a time of the recent past."""
        return self._trail.at(time_ns)

    def _fold(self, truth: TruthSample, latest_ns: int) -> bool:
        pose, captured_ns, newest_ns = truth.map_from_base, truth.stamp.captured_ns, self._trail.newest_ns
        if captured_ns == newest_ns:
            return True  # the same truth again
        if captured_ns > latest_ns or (newest_ns is not None and captured_ns < newest_ns):
            return False
        if not (truth.twist.finite and all(math.isfinite(value) for value in (pose.x, pose.y, pose.yaw))):
            return False
        self._trail.append(captured_ns, self._start_from_map @ pose, truth.twist)
        return True

    def snapshot(self) -> bytes:
        """Return the whole state."""
        return self._trail.snapshot()

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        self._trail.restore(snapshot)
