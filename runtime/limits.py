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

    def holds(self, v: float) -> bool:
        """Whether a velocity is inside the caps, to rounding."""
        return self.lowest - 1e-9 <= v <= self.highest + 1e-9


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
        v, a, (x, y, w) = motion.twist, motion.acceleration, self._axes
        x_low, x_high = _interval(v.vx, a.vx, x, speed_factor, self._dt)
        y_low, y_high = _interval(v.vy, a.vy, y, speed_factor, self._dt)
        w_low, w_high = _interval(v.wz, a.wz, w, speed_factor, self._dt)
        return ReachableSet(BodyTwist(x_low, y_low, w_low), BodyTwist(x_high, y_high, w_high))

    def stopping(self, motion: Motion) -> BodyTwist:
        """Return the next twist of a stop: each axis towards zero with the stop's own deceleration, jerk aside."""
        x, y, w = (
            math.copysign(max(0.0, abs(v) - axis.stop * self._dt), v)
            for v, axis in zip(_values(motion.twist), self._axes, strict=True)
        )
        return BodyTwist(x, y, w)

    def within_caps(self, twist: BodyTwist) -> bool:
        """Whether the twist is inside the velocity caps (to rounding)."""
        x, y, w = self._axes
        return x.holds(twist.vx) and y.holds(twist.vy) and w.holds(twist.wz)

    def nearest(self, twist: BodyTwist) -> BodyTwist:
        """Return the twist inside the caps that is nearest to one which was measured: a skid-steer slips sideways too."""
        x, y, w = (min(max(v, axis.lowest), axis.highest) for v, axis in zip(_values(twist), self._axes, strict=True))
        return BodyTwist(x, y, w)

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
    low = min(max(-_room(v - factor * axis.lowest, axis.jerk, dt), soonest), latest)
    high = min(max(_room(factor * axis.highest - v, axis.jerk, dt), soonest), latest)
    return v + min(low, high) * dt, v + max(low, high) * dt


def _room(gap: float, jerk: float, dt: float) -> float:
    """Return the largest acceleration that can still be ended within a velocity gap; negative beyond the cap."""
    if gap < 0.0:
        return gap / dt
    return jerk * (math.sqrt(dt * dt + 2.0 * gap / jerk) - dt)
