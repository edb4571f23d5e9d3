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
    stop: float


@dataclass(frozen=True, slots=True)
class Motion:
    """The twist last sent and the acceleration it was reached with [per s]."""

    twist: BodyTwist = field(default_factory=BodyTwist)
    acceleration: BodyTwist = field(default_factory=BodyTwist)


class Limiter:
    """Computes reachable sets and stops for one base."""

    def __init__(self, limits: BaseLimits, period_s: float) -> None:
        """Take the base's limits and the control period."""
        self._axes = tuple(_axis(limits, name) for name in AXES)
        self._dt = period_s

    def reachable(self, motion: Motion, speed_factor: float = 1.0) -> ReachableSet:
        """Return the box of twists that can be sent one period after `motion`; caps are times `speed_factor`."""
        velocities, accelerations = _values(motion.twist), _values(motion.acceleration)
        x, y, w = (
            _interval(v, a, axis, speed_factor, self._dt)
            for v, a, axis in zip(velocities, accelerations, self._axes, strict=True)
        )
        return ReachableSet(BodyTwist(x[0], y[0], w[0]), BodyTwist(x[1], y[1], w[1]))

    def stopping(self, motion: Motion) -> BodyTwist:
        """Return the next twist of a stop: each axis towards zero with the stop's own deceleration, jerk aside."""
        x, y, w = (
            math.copysign(max(0.0, abs(v) - axis.stop * self._dt), v)
            for v, axis in zip(_values(motion.twist), self._axes, strict=True)
        )
        return BodyTwist(x, y, w)

    def within_caps(self, twist: BodyTwist) -> bool:
        """Whether the twist is inside the velocity caps (to rounding)."""
        eps = 1e-9
        inside = (a.lowest - eps <= v <= a.highest + eps for v, a in zip(_values(twist), self._axes, strict=True))
        return all(inside)

    def after(self, motion: Motion, sent: BodyTwist) -> Motion:
        """Return the motion after `sent` was sent."""
        before, dt = motion.twist, self._dt
        return Motion(sent, BodyTwist((sent.vx - before.vx) / dt, (sent.vy - before.vy) / dt, (sent.wz - before.wz) / dt))


def _values(twist: BodyTwist) -> tuple[float, float, float]:
    return twist.vx, twist.vy, twist.wz


def _axis(limits: BaseLimits, name: str) -> _Axis:
    cap = getattr(limits.velocity, name)
    return _Axis(
        0.0 if name == "vx" and not limits.reverse else -cap,
        cap,
        getattr(limits.acceleration, name),
        getattr(limits.jerk, name),
        getattr(limits.stop_deceleration, name),
    )


def _interval(v: float, a: float, axis: _Axis, factor: float, dt: float) -> tuple[float, float]:
    """Return the lowest and highest next value of one axis.

    The next acceleration lies within jerk * dt of the present one and within its cap, and must leave room to bring it back
    to zero before the velocity cap: v + a dt + a^2 / (2 jerk) <= cap.
    """
    if axis.highest == 0.0 and axis.lowest == 0.0:
        return 0.0, 0.0
    a = min(max(a, -axis.acceleration), axis.acceleration)  # a stop may have braked harder than this
    soonest, latest = max(-axis.acceleration, a - axis.jerk * dt), min(axis.acceleration, a + axis.jerk * dt)
    ends = (-_room(v - factor * axis.lowest, axis.jerk, dt), _room(factor * axis.highest - v, axis.jerk, dt))
    low, high = (min(max(end, soonest), latest) for end in ends)
    return v + min(low, high) * dt, v + max(low, high) * dt


def _room(gap: float, jerk: float, dt: float) -> float:
    """Return the largest acceleration that can still be ended within a velocity gap; negative beyond the cap."""
    if gap < 0.0:
        return gap / dt
    return jerk * (math.sqrt(dt * dt + 2.0 * gap / jerk) - dt)
