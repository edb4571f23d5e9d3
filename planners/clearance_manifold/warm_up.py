"""A scene of a few metres of empty corridor, to compile every kernel on before the first tick."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.samples import frozen_array
from estimators.belief import FREE, Belief, ClearanceField, Lattice, OccupancyGrid
from planners.planner import Plan
from planners.router import Route

SECOND_NS = 1_000_000_000  # apart: long enough for other branches to be looked at


class Plans(Protocol):
    """What can be asked for a plan."""

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return what to do now."""
        ...


def rehearse(planner: Plans) -> None:
    """Have two plans made, the second of which continues the first."""
    lattice = Lattice(-3.0, -3.0, 0.1, 60, 60)
    shape = (lattice.rows, lattice.columns)
    known = frozen_array(np.ones(shape, np.bool_))
    clearance = frozen_array(np.full(shape, 1.0, np.float32))
    field = ClearanceField(lattice, clearance, frozen_array(np.zeros(shape, np.float32)), known, known)
    grid = OccupancyGrid(lattice, frozen_array(np.full(shape, FREE, np.uint8)))
    path = frozen_array(np.stack((np.linspace(0.0, 2.0, 21), np.zeros(21)), axis=1))
    for tick in range(2):
        belief = Belief(tick, tick * SECOND_NS, SE2(), SE2(), BodyTwist(), np.zeros((3, 3)), grid, field, (), None, 0)
        planner.plan(belief, Route((2.0, 0.0), path, 2.0))
