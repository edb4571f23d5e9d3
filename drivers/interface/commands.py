"""What devices are told.  A command expires: the last process before the wire never repeats an old one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class BodyTwist:
    """Velocity of a base in its own frame: vx, vy [m/s], wz [rad/s]."""

    vx: float = 0.0
    vy: float = 0.0
    wz: float = 0.0

    @property
    def finite(self) -> bool:
        """Whether every component is a finite number."""
        return math.isfinite(self.vx) and math.isfinite(self.vy) and math.isfinite(self.wz)

    @property
    def speed_m_s(self) -> float:
        """Speed over ground [m/s]."""
        return math.hypot(self.vx, self.vy)


@dataclass(frozen=True, slots=True)
class BaseLimits:
    """What a base may be asked: caps, acceleration and jerk per axis (vx, vy, wz).  A cap of 0 on vy: it cannot strafe."""

    velocity: BodyTwist  # m/s, m/s, rad/s
    acceleration: BodyTwist  # m/s^2, m/s^2, rad/s^2
    jerk: BodyTwist  # m/s^3, m/s^3, rad/s^3
    stop_deceleration: BodyTwist  # the profile of a stop
    reverse: bool = True  # whether vx may be negative

    @property
    def holonomic(self) -> bool:
        """Whether the base can move sideways."""
        return self.velocity.vy > 0.0


@dataclass(frozen=True, slots=True)
class JointTrajectory:
    """Knots that the arm's own 1 kHz process interpolates; it comes to rest at the last one.  No knots: it comes to rest now.

    Knot times count from `start_ns`, so the same trajectory sent again only lives longer; it does not begin anew.
    """

    start_ns: int  # on the loop's clock
    time_from_start_s: NDArray[np.float64]  # (knots,)
    position_rad: NDArray[np.float64]  # (knots, joints)
    velocity_rad_s: NDArray[np.float64]  # (knots, joints)
    speed_factor: float = 1.0  # share of the velocity limits that the arm may use; it follows late where that is too little

    @classmethod
    def rest(cls) -> JointTrajectory:
        """Return the order to come to rest at once."""
        return cls(0, np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)))

    @property
    def is_rest(self) -> bool:
        """Whether this is the order to come to rest at once."""
        return len(self.time_from_start_s) == 0

    @property
    def finite(self) -> bool:
        """Whether every time, position and velocity is a finite number."""
        parts = (self.time_from_start_s, self.position_rad, self.velocity_rad_s, self.speed_factor)
        return all(bool(np.isfinite(part).all()) for part in parts)


@dataclass(frozen=True, slots=True, eq=False)
class JointLimits:
    """What each joint of an arm may be asked; every field has the shape (joints,)."""

    position_min_rad: NDArray[np.float64]
    position_max_rad: NDArray[np.float64]
    velocity_rad_s: NDArray[np.float64]
    acceleration_rad_s2: NDArray[np.float64]
    jerk_rad_s3: NDArray[np.float64]
    torque_nm: NDArray[np.float64]

    def fault_of(self, trajectory: JointTrajectory) -> str:
        """Return what is wrong with a trajectory as the end of a sentence, or nothing when it can be followed.

        Only the knots are judged; between them the arm keeps its limits itself and follows late where it must.
        """
        if trajectory.is_rest:
            return ""
        time_s, position, velocity = trajectory.time_from_start_s, trajectory.position_rad, trajectory.velocity_rad_s
        joints = len(self.velocity_rad_s)
        shape = (len(time_s), joints)
        if len(time_s) < 2 or position.shape != shape or velocity.shape != shape:
            return f"needs at least two knots of {joints} positions and velocities; got {position.shape} and {velocity.shape}"
        if not trajectory.finite:
            return "is not finite"
        if time_s[0] < 0.0 or (np.diff(time_s) <= 0.0).any():
            return "has knot times that do not increase"
        if (position < self.position_min_rad).any() or (position > self.position_max_rad).any():
            return "leaves the joints' range"
        if (np.abs(velocity) > self.velocity_rad_s).any():
            return "is faster than the joints' velocity limits"
        if not 0.0 < trajectory.speed_factor <= 1.0:
            return f"has a speed factor of {trajectory.speed_factor:g}, which is not above 0 and at most 1"
        return ""


@dataclass(frozen=True, slots=True)
class Command:
    """One typed command per device; None: the device is not told anything."""

    base: BodyTwist | None
    arm: JointTrajectory | None
    expires_ns: int
    oldest_input_ns: int  # capture time of the oldest sample that the command rests on
