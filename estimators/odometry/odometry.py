"""The contract of odometry, and the trail of poses that every kind of it keeps."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2, wrap_angle
from drivers.interface.sensed import Sensed
from drivers.interface.stateful import Stateful, pack, unpack
from estimators.belief import F64, EstimatorFault

SECOND_NS = 1_000_000_000
FUTURE_TOLERANCE_NS = SECOND_NS // 10  # a stamp later than the tick by more than this is wrong
STAMP_SLACK_S = 0.01  # by so much a stamp may be wrong: samples that are stamped on arrival bunch when the host is busy


@dataclass(frozen=True, slots=True)
class OdometryEstimate:
    """How the base has moved since the start, at the tick's time."""

    odom_from_base: SE2
    twist: BodyTwist
    covariance: F64  # (3, 3): x, y [m], yaw [rad]
    newest_capture_ns: int | None  # None: nothing came yet
    faults: tuple[EstimatorFault, ...]
    slipping: bool = False  # the wheels contradict the inertial unit now
    dropped: int = 0  # samples since the start that could not be used


class Odometry(Stateful, Protocol):
    """Turns what was sensed into motion since the start; odom is continuous and begins at the identity."""

    def warm_up(self) -> None:
        """Compile every kernel; called once before the first tick."""
        ...

    def update(self, sensed: Sensed) -> OdometryEstimate:
        """Fold in all samples; bad ones are dropped and are a fault in the estimate, never an exception."""
        ...

    def pose_at(self, time_ns: int) -> SE2:
        """Return odom_from_base at a time of the recent past, such as when a frame was captured."""
        ...


def is_plausible(motion: SE2, elapsed_s: float, speed_max_m_s: float, turn_rate_max_rad_s: float) -> bool:
    """Tell whether a base can have moved so in the time; a NaN is never plausible."""
    return motion.distance(SE2()) <= speed_max_m_s * elapsed_s and abs(motion.yaw) <= turn_rate_max_rad_s * elapsed_s


def latest_valid_ns(sensed: Sensed) -> int:
    """Return the latest capture time that a sample of this tick can honestly bear."""
    return sensed.tick.start_ns + sensed.tick.lateness_ns + FUTURE_TOLERANCE_NS


class PoseTrail:
    """The poses of the last moments; linear in between (samples are dense), the last twist goes on after the newest."""

    def __init__(self, span_s: float, extrapolation_max_s: float) -> None:
        """Keep `span_s` of poses; believe the last twist for at most `extrapolation_max_s`."""
        self._span_ns = round(span_s * SECOND_NS)
        self._extrapolation_max_s = extrapolation_max_s
        self._times_ns: list[int] = []
        self._poses: list[SE2] = []
        self._twist = BodyTwist()

    @property
    def newest_ns(self) -> int | None:
        """When the newest pose was captured."""
        return self._times_ns[-1] if self._times_ns else None

    @property
    def pose(self) -> SE2:
        """The newest pose."""
        return self._poses[-1] if self._poses else SE2()

    @property
    def twist(self) -> BodyTwist:
        """The twist at the newest pose."""
        return self._twist

    def append(self, time_ns: int, pose: SE2, twist: BodyTwist) -> None:
        """Add a pose that is newer than all others."""
        self._times_ns.append(time_ns)
        self._poses.append(pose)
        self._twist = twist
        stale = max(0, bisect_right(self._times_ns, time_ns - self._span_ns) - 1)  # one is kept from before the span
        del self._times_ns[:stale], self._poses[:stale]

    def rewind(self, time_ns: int) -> None:
        """Forget the poses from a time on, so that others can take their place."""
        kept = bisect_left(self._times_ns, time_ns)
        del self._times_ns[kept:], self._poses[kept:]

    def at(self, time_ns: int) -> SE2:
        """Return the pose at a time; the oldest one for what lies before the trail."""
        after = bisect_right(self._times_ns, time_ns)
        if after == len(self._times_ns):
            return self._beyond(time_ns)
        if after == 0:
            return self._poses[0]
        start, end = self._poses[after - 1], self._poses[after]
        start_ns, end_ns = self._times_ns[after - 1], self._times_ns[after]
        share = (time_ns - start_ns) / (end_ns - start_ns)
        turn = wrap_angle(end.yaw - start.yaw)
        x, y = start.x + share * (end.x - start.x), start.y + share * (end.y - start.y)
        return SE2(x, y, wrap_angle(start.yaw + share * turn))

    def _beyond(self, time_ns: int) -> SE2:
        if not self._times_ns:
            return SE2()
        ahead_s = min((time_ns - self._times_ns[-1]) / SECOND_NS, self._extrapolation_max_s)
        return self._poses[-1].integrate(self._twist.vx, self._twist.vy, self._twist.wz, ahead_s)

    def snapshot(self) -> bytes:
        """Return the whole state."""
        poses = np.array([(pose.x, pose.y, pose.yaw) for pose in self._poses]).reshape(-1, 3)
        twist = (self._twist.vx, self._twist.vy, self._twist.wz)
        return pack(times_ns=np.array(self._times_ns, dtype=np.int64), poses=poses, twist=twist)

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        self._times_ns = state["times_ns"].tolist()
        self._poses = [SE2(*pose) for pose in state["poses"].tolist()]
        self._twist = BodyTwist(*state["twist"].tolist())
