"""What velocity, acceleration and jerk limits admit at a tick, and the profile of a stop."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from drivers.interface.commands import BaseLimits, BodyTwist
from planners.shield import ReachableSet

AXES = ("vx", "vy", "wz")


@dataclass(frozen=True, slots=True)
class _Axis:
    lowest: float
    highest: float
    acceleration: float
    jerk: float


@dataclass(frozen=True, slots=True)
class Motion:
    """The twist last sent and the acceleration it was reached with [per s]."""

    twist: BodyTwist = field(default_factory=BodyTwist)
    acceleration: BodyTwist = field(default_factory=BodyTwist)


class Limiter:
    """Computes reachable sets and stops for one base."""

    def __init__(self, limits: BaseLimits, period_s: float) -> None:
        """Take the base's limits and the control period."""
        self._limits = limits
        self._dt = period_s

    def reachable(self, motion: Motion, speed_factor: float = 1.0) -> ReachableSet:
        """Return the box of twists that can be sent one period after `motion`; caps are times `speed_factor`."""
        pairs = []
        for name in AXES:
            axis = self._axis(name, speed_factor)
            pairs.append(_interval(getattr(motion.twist, name), getattr(motion.acceleration, name), axis, self._dt))
        (x, y, w) = pairs
        return ReachableSet(BodyTwist(x[0], y[0], w[0]), BodyTwist(x[1], y[1], w[1]))

    def stopping(self, motion: Motion) -> BodyTwist:
        """Return the next twist of a stop: each axis towards zero with the stop's own deceleration, jerk aside."""
        values = []
        for name in AXES:
            v, step = getattr(motion.twist, name), getattr(self._limits.stop_deceleration, name) * self._dt
            values.append(math.copysign(max(0.0, abs(v) - step), v) if abs(v) > step else 0.0)
        return BodyTwist(*values)

    def within_caps(self, twist: BodyTwist) -> bool:
        """Whether the twist is inside the velocity caps (to rounding)."""
        eps = 1e-9
        return all(
            self._axis(name, 1.0).lowest - eps <= getattr(twist, name) <= self._axis(name, 1.0).highest + eps for name in AXES
        )

    def after(self, motion: Motion, sent: BodyTwist) -> Motion:
        """Return the motion after `sent` was sent."""
        rates = ((getattr(sent, name) - getattr(motion.twist, name)) / self._dt for name in AXES)
        return Motion(sent, BodyTwist(*rates))

    def _axis(self, name: str, factor: float) -> _Axis:
        limits = self._limits
        cap = getattr(limits.velocity, name) * factor
        lowest = 0.0 if name == "vx" and not limits.reverse else -cap
        return _Axis(
            lowest,
            cap,
            getattr(limits.acceleration, name),
            getattr(limits.jerk, name),
        )


def _interval(v: float, a: float, axis: _Axis, dt: float) -> tuple[float, float]:
    """Return the lowest and highest next value of one axis.

    The next acceleration lies within jerk * dt of the present one and within its cap, and must leave room to bring it back
    to zero before the velocity cap: v + a dt + a^2 / (2 jerk) <= cap.
    """
    if axis.highest == 0.0 and axis.lowest == 0.0:
        return 0.0, 0.0
    a = min(max(a, -axis.acceleration), axis.acceleration)  # a stop may have braked harder than this
    soonest, latest = max(-axis.acceleration, a - axis.jerk * dt), min(axis.acceleration, a + axis.jerk * dt)
    ends = (-_room(v - axis.lowest, axis.jerk, dt), _room(axis.highest - v, axis.jerk, dt))
    low, high = sorted(min(max(end, soonest), latest) for end in ends)
    return v + low * dt, v + high * dt


def _room(gap: float, jerk: float, dt: float) -> float:
    """Return the largest acceleration that can still be ended within a velocity gap; negative beyond the cap."""
    if gap < 0.0:
        return gap / dt
    return jerk * (math.sqrt(dt * dt + 2.0 * gap / jerk) - dt)
