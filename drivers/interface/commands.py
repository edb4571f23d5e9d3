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
    """Knots that the arm's own 1 kHz process interpolates; it comes to rest at the last one."""

    time_from_start_s: NDArray[np.float64]  # (knots,)
    position_rad: NDArray[np.float64]  # (knots, joints)
    velocity_rad_s: NDArray[np.float64]  # (knots, joints)


@dataclass(frozen=True, slots=True)
class Command:
    """One typed command per device; None: the device is not told anything."""

    base: BodyTwist | None
    arm: JointTrajectory | None
    expires_ns: int
    oldest_input_ns: int  # capture time of the oldest sample that the command rests on
