"""A scene of a corridor with somebody in it, to compile every kernel on before the first tick."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.samples import frozen_array
from estimators.belief import FREE, Belief, ClearanceField, Lattice, OccupancyGrid, Track
from planners import static_field
from planners.planner import Plan
from planners.router import Route

PERIOD_NS = 50_000_000


class Plans(Protocol):
    """What can be asked for a plan."""

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return what to do now."""
        ...


def scene(tick: int, *, tracks: bool) -> Belief:
    """Return a belief of free ground, its arrays read-only as a belief's are."""
    lattice = Lattice(-3.0, -3.0, 0.1, 60, 60)
    shape = (lattice.rows, lattice.columns)
    known = frozen_array(np.ones(shape, np.bool_))
    clearance = frozen_array(np.full(shape, 1.0, np.float32))
    field = ClearanceField(lattice, clearance, frozen_array(np.zeros(shape, np.float32)), known, known)
    grid = OccupancyGrid(lattice, frozen_array(np.full(shape, FREE, np.uint8)))
    somebody = Track(0, (1.0, 0.1), (-0.5, 0.0), 0.2, frozen_array(np.zeros((4, 4))))
    seen = (somebody,) if tracks else ()
    return Belief(tick, tick * PERIOD_NS, SE2(), SE2(), BodyTwist(), np.zeros((3, 3)), grid, field, seen, None, 0)


def rehearse(planner: Plans) -> None:
    """Have plans made with and without somebody there."""
    static_field.warm_up(scene(0, tracks=False).grid.label)
    path = np.stack((np.linspace(0.0, 2.0, 21), np.zeros(21)), axis=1)
    for tick, tracks in enumerate((False, True, True)):
        for way in (path, frozen_array(path.copy())):
            planner.plan(scene(tick, tracks=tracks), Route((2.0, 0.0), way, 2.0))
