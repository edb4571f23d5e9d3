"""On which hand who comes passes: the one answer that the branch, its boxes and who gives way keep to.

Ours; the paper's field says only that something closes in.  README.md beside this file says why.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.belief import F64, Mask
from planners.clearance_manifold.closing import SLOTS
from planners.clearance_manifold.extraction import Scene, Solver
from planners.clearance_manifold.passing_kernels import ABREAST_M, give_way, left_to, meeting, runs_along
from planners.clearance_manifold.ridge_kernels import Sections

SIDE_S = 6.0  # so long before he passes a hand is chosen: from where who walks slowly comes into view
GAIN_M, ONLY_M = 0.4, 0.2  # the other hand must be better by this, and if only that one can still be got to
BRANCH = 0.25  # of what a branch costs a station: where there is no room it is 5 m and more, and noise is 0.5 m
ACROSS_S = 0.6  # so long what leads across the way of who comes along it counts: it is noise, or he turns back before the wall
BOUND_FOR_S = 0.5  # so long a velocity across the way leads on before the robot could turn back
STRAIGHT_ON_M = 0.28  # with a miss smaller than this somebody comes straight on


class Passing:
    """Chooses a hand when somebody begins to come, and when he turns along the way or across it.

    In between it keeps it unless the other is much better, or alone can be got to yet.
    """

    def __init__(self, solver: Solver, apart_m: float, speed_m_s: float) -> None:
        """Take what knows the branches, how far apart who passes is kept, and how fast the robot gets there."""
        self._solver, self._apart_m, self._speed_m_s = solver, apart_m, speed_m_s
        self.reset()

    def reset(self) -> None:
        """Nobody comes."""
        self._hands, self._along = np.zeros(SLOTS), np.zeros(SLOTS, np.bool_)

    def warm_up(self) -> None:
        """Compile what a rehearsal in an empty corridor does not call."""
        sections, closing = (
            Sections(np.zeros((1, 2)), np.array([[0.0, 1.0]]), np.zeros((1, 2))),
            np.array([1.0, 0.0, -1.0, 0.0, 1.0]),
        )
        meeting(np.zeros(2), closing)
        runs_along(sections.normal[0], closing)
        left_to(1.0, sections, 0, np.zeros(2), 1.0, closing, 0.1)
        give_way(np.zeros(2), np.zeros(2), closing, 0.1, 1.0, 1.0)

    def update(self, scene: Scene, velocity: F64, begins: Mask) -> tuple[F64, Scene]:
        """Return the hands on which what closes in passes, shape (SLOTS,), and the scene with what that leaves of it.

        Who passes first has the first choice: the others choose in what he leaves.

        The hand is seen along the way of who comes: 1 left of the robot, -1 right of it, 0: nobody comes.

        Args:
            scene: what a manifold is laid through.
            velocity: of the base, in odom, shape (2,).
            begins: whether what is in a slot is somebody else than at the tick before, shape (SLOTS,).
        """
        self._hands[begins] = 0.0
        times_s = np.array([meeting(scene.robot, who)[0] for who in scene.closing])
        comes = (times_s < SIDE_S) & (times_s * np.hypot(scene.closing[:, 2], scene.closing[:, 3]) > -ABREAST_M)
        self._hands[~comes] = 0.0
        for slot in sorted(np.flatnonzero(comes).tolist(), key=lambda slot: times_s[slot]):
            scene = self._passes(scene, velocity, slot, float(times_s[slot]))
        return self._hands.copy(), scene

    def _passes(self, scene: Scene, velocity: F64, slot: int, time_s: float) -> Scene:
        """Choose the hand of who passes in `time_s`, or keep it; return what he leaves of the scene."""
        normal, who = scene.sections.normal[self._solver.own], scene.closing[slot]
        along = runs_along(normal, who)
        goes_on = along or self._hands[slot] != 0.0  # towards who only begins to cross, it need not
        bound_for = scene.robot + BOUND_FOR_S * velocity if goes_on else scene.robot
        miss_m = meeting(bound_for, _turned_along(who, normal, time_s) if along else who)[1]
        gain_m = self._gain(slot, miss_m, time_s) if along == self._along[slot] else 0.0  # who turns is somebody else
        self._along[slot] = along
        if gain_m < math.inf:
            self._choose(scene, slot, miss_m, gain_m, along=along)
        return self._beside(scene, who, self._hands[slot]) if along else scene

    def _gain(self, slot: int, miss_m: float, time_s: float) -> float:
        """Return by how much the other hand must be better [m].

        By less where only that one can be got to before he passes, from where the robot is bound for; infinitely where only
        this one can.
        """
        if self._hands[slot] == 0.0:
            return -math.inf
        reach_m = self._speed_m_s * max(0.0, time_s - BOUND_FOR_S)
        this, other = (self._apart_m - hand * miss_m <= reach_m for hand in (self._hands[slot], -self._hands[slot]))
        if this == other:
            return GAIN_M
        return math.inf if this else ONLY_M

    def _choose(self, scene: Scene, slot: int, miss_m: float, gain_m: float, *, along: bool) -> None:
        """Take the hand with the shorter way aside and, of who comes along the way, the better branch, if it is by that much."""
        who, burdens = scene.closing[slot], {hand: max(0.0, self._apart_m - hand * miss_m) for hand in (-1.0, 1.0)}
        if along:
            burdens = {hand: m + BRANCH * self._solver.pays(self._beside(scene, who, hand)) for hand, m in burdens.items()}
        elif self._hands[slot] == 0.0 and abs(miss_m) < STRAIGHT_ON_M:  # who crosses is passed behind
            normal, (x, y) = scene.sections.normal[self._solver.own], who[2:4]
            burdens = {hand: -hand * float(normal @ (x, y)) * float(normal @ (-y, x)) for hand in burdens}
        better = min(burdens, key=lambda hand: burdens[hand])
        if burdens.get(float(self._hands[slot]), math.inf) - burdens[better] > gain_m:
            self._hands[slot] = better

    def _beside(self, scene: Scene, who: F64, hand: float) -> Scene:
        """Return what who comes along the way, shape (5,), leaves of a scene on the robot's hand of him."""
        own, least_m = self._solver.own, self._solver.least_m
        reach = left_to(hand, scene.sections, own, scene.robot, scene.speed_m_s, who, least_m)
        return replace(scene, sections=scene.sections._replace(reach=reach))

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is carried on, as named arrays."""
        return {"hands": self._hands.copy(), "along": self._along.copy()}

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._hands, self._along = state["hands"].copy(), state["along"].copy()


def _turned_along(closing: F64, normal: F64, time_s: float) -> F64:
    """Return who comes along a way with this normal, shape (2,): across it he is in `time_s` where he is after ACROSS_S."""
    turned = closing.copy()
    turned[2:4] -= max(0.0, 1.0 - ACROSS_S / max(time_s, ACROSS_S)) * float(normal @ closing[2:4]) * normal
    return turned
