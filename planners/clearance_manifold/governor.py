"""The velocity asked follows the one wanted with as little jerk as the situation leaves time for.

Ours; the paper's base takes every velocity at once.  README.md beside this file says what it costs and buys.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BaseLimits
from drivers.interface.samples import frozen_array
from estimators.belief import F64, Mask
from planners.clearance_manifold.governor_kernels import followed, jerk_to_move, jerk_to_pass, jerk_to_stop, room_along
from planners.clearance_manifold.ridge_kernels import Ground
from planners.clearance_manifold.settings import SmoothnessSettings

SMALL_M_S = 0.02
LOOK_M = 1.0  # how far ahead of the excess velocity is looked


@dataclass(frozen=True, slots=True)
class Around:
    """Where the robot may not get to."""

    ground: Ground  # the field on arrival
    known: Mask  # (rows, columns), what was seen
    least_m: float  # rho_min
    body_m: float  # what it stands on is known


@dataclass(frozen=True, slots=True)
class Motion:
    """What the base does."""

    robot: F64  # (2,), in odom
    velocity: F64  # (2,), in odom
    tangent: F64  # (2,), of the manifold
    free_m: float  # along it, in which the base must be able to stop,
    clear_m: float  # and in which it is to stop as soon as it can without haste


class Governor:
    """Carries velocity and acceleration of the reference on, in odom: turning the robot does not turn what it follows."""

    def __init__(self, settings: SmoothnessSettings, limits: BaseLimits, period_s: float) -> None:
        """Start at rest."""
        self._settings, self._period_s = settings, period_s
        self._most_m_s2 = max(limits.acceleration.vx, limits.acceleration.vy)
        self._most_m_s3 = max(limits.jerk.vx, limits.jerk.vy)
        self.reset()

    def reset(self) -> None:
        """Stand."""
        self._velocity: F64 = np.zeros(2)
        self._acceleration: F64 = np.zeros(2)

    def warm_up(self) -> None:
        """Compile what a rehearsal in an empty corridor does not call, on a read-only mask as a belief's is."""
        known = frozen_array(np.ones((3, 3), np.bool_))
        around = Around(Ground(np.ones((3, 3), np.float32), 0.0, 0.0, 1.0), known, 0.1, 0.1)
        self._velocity = np.array([1.0, 0.0])
        self._to_stop(np.zeros(2), Motion(np.zeros(2), np.zeros(2), np.array([1.0, 0.0]), 1.0, 1.0), around)
        self.reset()

    @property
    def enabled(self) -> bool:
        """Whether anything is smoothed."""
        return self._settings.enabled

    @property
    def ease_m_s3(self) -> float:
        """The jerk that is used while nothing presses."""
        return self._settings.jerk_m_s3 if self.enabled else self._most_m_s3

    def pressing(self, error_m: float, pass_s: float) -> float:
        """Return the jerk to use at least, to be on the manifold when somebody passes in `pass_s` [m/s^3]."""
        return self._within(jerk_to_move(error_m, pass_s))

    def to_change(self, change_m_s: float, pass_s: float) -> float:
        """Return the jerk to use at least, to change the velocity before somebody passes in `pass_s` [m/s^3]."""
        return self._within(jerk_to_pass(change_m_s, pass_s))

    def follow(self, wanted: F64, at: Motion, around: Around, least_m_s3: float) -> F64:
        """Return the velocity to ask for now, shape (2,), in odom [m/s].

        Args:
            wanted: shape (2,), in odom.
            at: what the base does, and in which way it must be able to stop.
            around: where it may not get to.
            least_m_s3: jerk that is used at least.
        """
        s = self._settings
        if not s.enabled:
            return wanted
        off = self._velocity - at.velocity
        apart = float(np.hypot(*off))
        if apart > s.slip_m_s:
            self._velocity = at.velocity + off * (s.slip_m_s / apart)
        jerk = max(least_m_s3, self._to_stop(wanted, at, around))
        self._velocity, self._acceleration = followed(
            self._velocity, self._acceleration, wanted, self._within(jerk), self._within(math.inf),
            self._most_m_s2, s.response_per_s, self._period_s,
        )  # fmt: skip
        return self._velocity.copy()

    def _to_stop(self, wanted: F64, at: Motion, around: Around) -> float:
        """Return the jerk that loses the velocity which is wanted no more before it has led too far [m/s^3]."""
        excess = self._velocity - wanted
        length = float(np.hypot(*excess))
        speed = min(length, float(self._velocity @ excess) / max(length, 1e-9))  # not what is gained from rest
        if speed < SMALL_M_S:
            return 0.0
        room_m = room_along(around.ground, around.known, at.robot, excess / length, around.least_m, around.body_m, LOOK_M)
        along_m_s = max(0.0, speed * float(excess @ at.tangent) / length)
        watched_m_s3 = min(jerk_to_stop(along_m_s, at.clear_m), self._settings.watchful_m_s3)
        return float(max(jerk_to_stop(speed, room_m), jerk_to_stop(along_m_s, at.free_m), watched_m_s3))

    def _within(self, jerk: float) -> float:
        s = self._settings
        return min(max(s.jerk_m_s3, min(jerk, s.urgent_m_s3)), self._most_m_s3)

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is carried on, as named arrays."""
        return {"reference": np.concatenate((self._velocity, self._acceleration))}

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._velocity, self._acceleration = state["reference"][:2].copy(), state["reference"][2:].copy()


def approach(distance_m: float, jerk_m_s3: float) -> float:
    """Return the speed from which the rest of a way is just enough to stop with a constant jerk of either sign [m/s].

    Braking with a triangular acceleration takes 2 sqrt(v / jerk) and v sqrt(v / jerk) of way.

    >>> approach(1.0, 1.0)
    1.0
    """
    return math.cbrt(jerk_m_s3 * distance_m * distance_m)
