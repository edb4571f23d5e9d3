"""Speed by what is seen: whoever may step out of the unknown must find the robot before his way, or past it.

Beyond the paper, whose section 7 leaves the blind corner open.  README.md beside this file derives for which walkers it holds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BaseLimits
from estimators.belief import F64
from planners.clearance_manifold.lookout_kernels import Seen, Unseen, arrivals, openings
from planners.clearance_manifold.settings import LookoutSettings

SPACING_M = 0.1  # of the rays along the way
TIE_S = 0.3  # a side is looked at until the other is more urgent by this
LOOK_M = 1.0  # openings farther ahead are not turned to


@dataclass(frozen=True, slots=True)
class Outlook:
    """What unseen walkers leave of the way."""

    free_m: float = math.inf  # how far ahead the robot may go
    speed_m_s: float = math.inf  # and how fast at most
    look_at: F64 | None = None  # (2,), in odom: what is to be seen first
    demand_m_s: float = 0.0  # the walker who is reckoned with; 0: there is no opening
    waits: bool = False  # an opening is not clear
    creeps: bool = False  # and the robot is in it already, with nothing seen beside it


class Lookout:
    """Watches the openings along the way."""

    def __init__(self, settings: LookoutSettings, limits: BaseLimits, radius_m: float, speed_m_s: float) -> None:
        """Take the settings, the base's limits and the speed that openings are crossed at."""
        self._settings, self._speed_m_s = settings, speed_m_s
        self._apart_m = radius_m + settings.margin_m
        self._start_s = 0.5 * speed_m_s / limits.acceleration.vx + settings.reaction_s
        self.arcs_m = np.arange(-self._apart_m, settings.ahead_m, SPACING_M)  # of the rays, from the robot on
        self.reset()

    def reset(self) -> None:
        """Forget what it waits for."""
        self._waited_s, self._side, self._committed = 0.0, 0, False

    def leaving_s(self, distance_m: float, speed_m_s: float) -> float:
        """Return how long the robot takes to be so far ahead, from its present speed on, seen late by `reaction_s`."""
        missing = max(0.0, 1.0 - speed_m_s / self._speed_m_s)
        return self._start_s * missing + self._settings.reaction_s * (1.0 - missing) + max(0.0, distance_m) / self._speed_m_s

    @property
    def demand_m_s(self) -> float:
        """The walker who is reckoned with: less and less once its patience is over, or it would stand for good."""
        s = self._settings
        return s.walker_speed_m_s * min(max(2.0 - self._waited_s / s.patience_s, 0.0), 1.0)

    def watch(self, seen: Seen, at: F64, normal: F64, speed_m_s: float, period_s: float) -> Outlook:
        """Return how far and how fast the robot may go on, and where it should look.

        Args:
            seen: what is known.
            at: points of the way at `arcs_m`, shape (n, 2).
            normal: to the left there, shape (n, 2).
            speed_m_s: of the robot, along the way.
            period_s: since the last time.
        """
        s, demand = self._settings, self.demand_m_s
        if not s.enabled:
            return Outlook()
        unseen = Unseen(max(demand, 1e-3), self._apart_m, s.width_m, s.side_m)
        when, whence = arrivals(seen, at, normal, SPACING_M, unseen)
        found = openings(when, self.arcs_m, unseen)
        inside = bool((found[:, 0] < 0.0).any())
        self._committed &= inside
        for begin, end, soonest in found:
            if demand < 0.01 or soonest >= self.leaving_s(end, speed_m_s):
                self._committed |= begin < speed_m_s * 0.5 + 0.05
                continue
            if begin < 0.0 and self._committed:
                continue
            creeps = begin < -2.0 * self._apart_m  # nothing seen beside it tells where to wait: it goes on, slowly
            look_at = self._look_at(when, whence, at, normal, begin, end) if begin < LOOK_M else None
            if look_at is not None and speed_m_s < s.creep_m_s + 0.05:
                self._waited_s += 2.0 * period_s if creeps else period_s
            if creeps:
                return Outlook(math.inf, s.creep_m_s, look_at, demand, True, True)
            return Outlook(max(begin, 0.0), math.inf, look_at, demand, True)
        if not len(found):  # an opening that flickers is the same one
            self._waited_s = max(0.0, self._waited_s - period_s)
        return Outlook(demand_m_s=demand if len(found) else 0.0)

    def _look_at(self, when: F64, whence: F64, at: F64, normal: F64, begin: float, end: float) -> F64:
        """Return the nearest place out of view from which somebody can be there soonest, shape (2,)."""
        ahead = (self.arcs_m >= max(begin, 0.0)) & (self.arcs_m <= end)
        ahead[int(np.argmax(self.arcs_m >= 0.0))] |= not ahead.any()
        soonest = np.where(ahead[:, None], when, math.inf).min(axis=0)
        other = 1 - self._side
        if soonest[other] < soonest[self._side] - TIE_S or (math.isinf(soonest[self._side]) and soonest[self._side] > 0.0):
            self._side = other
        i = int(np.argmin(np.where(ahead, when[:, self._side], math.inf)))
        sign = 1.0 if self._side else -1.0
        return np.asarray(at[i] + sign * whence[i, self._side] * normal[i])

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is carried on, as named arrays."""
        return {"lookout": np.array([self._waited_s, float(self._side), float(self._committed)])}

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        waited_s, side, committed = state["lookout"].tolist()
        self._waited_s, self._side, self._committed = waited_s, int(side), bool(committed)
