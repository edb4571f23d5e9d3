"""The set points of a motion, one each millisecond, and the controller's clock."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivers.franka.client import MILLISECOND_NS, ArmState
from drivers.interface.arm_motion import PANDA, TrajectoryFollower
from drivers.interface.commands import JointTrajectory

# What the follower may use of the published limits.  The states carry 32-bit floats: where a set point must go on from what the
# controller reports, rounding alone makes a jerk of 250 rad/s^3.
DRIVEN = replace(
    PANDA,
    velocity_rad_s=0.99 * PANDA.velocity_rad_s,
    acceleration_rad_s2=0.95 * PANDA.acceleration_rad_s2,
    jerk_rad_s3=0.85 * PANDA.jerk_rad_s3,
)
NEVER_NS = 1 << 62  # an order's end is the last hop's business
# What is nearer than this is the same but for 32-bit rounding, and goes into the jerk's margin; a lost command shows as more.
SAME_RAD, SAME_RAD_S, SAME_RAD_S2 = 4e-7, 3e-4, 0.3
STANDS_MS = 500  # a motion ends when the set point has stood for so long without a trajectory
DRIFT = 2e-3  # by which the controller's clock may seem to run slower, its world standing still at times included
JUMP_NS = 100_000_000


class RobotClock:
    """Converts between the controller's clock and CLOCK_MONOTONIC by the states that came fastest."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self._offset_ns: float | None = None
        self._last_ns = 0

    def update(self, robot_ns: int, now_ns: int) -> None:
        """Take a state's stamp and arrival."""
        seen = now_ns - robot_ns
        if self._offset_ns is None or abs(seen - self._offset_ns) > JUMP_NS:
            self._offset_ns = seen
        else:
            self._offset_ns = min(seen, self._offset_ns + DRIFT * (robot_ns - self._last_ns))
        self._last_ns = robot_ns

    def to_robot(self, host_ns: int) -> int:
        """Return a time of CLOCK_MONOTONIC on the controller's clock."""
        return host_ns - round(self._offset_ns or 0.0)

    def to_host(self, robot_ns: int) -> int:
        """Return a time of the controller's clock on CLOCK_MONOTONIC."""
        return robot_ns + round(self._offset_ns or 0.0)


class Exchange:
    """One motion: a set point for every state, from where the controller's own set point is.

    A command that came late is lost, and the controller has gone on with constant acceleration; the states show that, and the
    next set point continues from there, so that a lost command does not become a discontinuity.
    """

    def __init__(self, state: ArmState) -> None:
        """Begin at rest where the controller holds the arm."""
        self._follower = TrajectoryFollower(DRIVEN, state.target_rad)
        self._last_ns: int | None = None
        self._stood_ms = 0
        self.resumed = 0  # times it had to go on from elsewhere

    @property
    def is_at_rest(self) -> bool:
        """Whether there is nothing to follow and the set point stands."""
        return not self._follower.is_following and self._follower.is_at_rest

    @property
    def is_over(self) -> bool:
        """Whether it has stood long enough to end the motion."""
        return self._stood_ms >= STANDS_MS

    def follow(self, trajectory: JointTrajectory) -> None:
        """Follow a trajectory whose start is on the controller's clock."""
        self._follower.follow(trajectory, NEVER_NS)

    def stop(self) -> None:
        """Decelerate to rest."""
        self._follower.stop()

    def answer(self, state: ArmState) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Return the set point that answers a state [rad], shape (7,)."""
        follower, before_ns = self._follower, state.robot_ns - MILLISECOND_NS
        if self._last_ns is None:
            follower.resume(follower.position_rad, follower.velocity_rad_s, follower.acceleration_rad_s2, before_ns)
        elif self._last_ns != before_ns or self._differs(state):
            follower.resume(state.target_rad, state.target_rad_s, state.target_rad_s2, before_ns)
            self.resumed += 1
        self._last_ns = state.robot_ns
        follower.step(state.robot_ns)
        self._stood_ms = self._stood_ms + 1 if self.is_at_rest else 0
        return follower.position_rad

    def _differs(self, state: ArmState) -> bool:
        follower = self._follower
        return bool(
            (np.abs(state.target_rad_s2 - follower.acceleration_rad_s2) > SAME_RAD_S2).any()
            or (np.abs(state.target_rad_s - follower.velocity_rad_s) > SAME_RAD_S).any()
            or (np.abs(state.target_rad - follower.position_rad) > SAME_RAD).any()
        )
