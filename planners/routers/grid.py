"""Shortest path on the belief's grid, through what is free and what is unknown, towards a goal that may lie far outside it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.mission import Goal, Mission
from drivers.interface.samples import frozen_array
from drivers.interface.stateful import pack, unpack
from estimators.belief import Belief, Lattice
from planners import static_field
from planners.planner import no_path
from planners.polyline import arc_length, resample
from planners.router import Route, RouterSetup, goal_yaw
from planners.routers.grid_costs import CostGrid, GridCosts, cost_grid
from planners.routers.grid_kernels import near_cells, pull_straight
from planners.routers.grid_search import cheapest, way_to
from planners.routers.window import around, remainder_outside, ring

F64 = NDArray[np.float64]


class GridRouter:
    """Shortest path on the grid, preferring room, around what is occupied and through what is unknown.

    Dijkstra's search on cell costs; the target is the border cell from which path and remainder together cost least.
    """

    class Settings(GridCosts):
        """Costs of the cells, and how the way is chosen."""

        loyalty: float = Field(0.15, ge=0.0, lt=1.0, description="share by which the last route's cells are cheaper")
        loyalty_radius_m: float = Field(0.25, ge=0.0, le=2.0, description="how far from the last route that holds")
        detour_limit_m: float = Field(8.0, gt=0.0, le=1000.0, description="cost beyond the straight line that counts as blocked")

    def __init__(self, settings: Settings, setup: RouterSetup) -> None:
        """Start without a last route."""
        self._settings = settings
        self._radius_m = setup.robot_radius_m
        self._last = no_path()  # (n, 2) in odom

    def warm_up(self) -> None:
        """Compile the kernels."""
        way_to((1, 1), cheapest(np.ones((2, 2)), (0, 0), 1.0), np.ones((2, 2)), 1.0)
        pull_straight(np.zeros((2, 2)), np.ones((2, 2)))
        near_cells(np.zeros(1, np.int64), np.zeros(1, np.int64), 1, 2, 2)
        remainder_outside(np.zeros((1, 2)), ring(1, 1)[2], np.zeros(2), np.ones(2), np.full(2, 2.0))
        static_field.warm_up(frozen_array(np.zeros((2, 2), np.uint8)))

    def route(self, belief: Belief, mission: Mission) -> Route:
        """Return the route in odom, its length being the way to the border and the remainder beyond it."""
        if mission.goal is None:
            self._last = no_path()
            return Route(None, no_path(), 0.0)
        goal = belief.map_from_odom.inverse().apply(np.array([mission.goal.x_m, mission.goal.y_m]))
        path, remainder_m = self._search(belief, goal, mission.goal)
        self._last = path
        blocked = len(path) == 0
        length_m = 0.0 if blocked else float(arc_length(path)[-1]) + remainder_m
        return Route((float(goal[0]), float(goal[1])), path, length_m, blocked, goal_yaw(belief, mission.goal))

    def snapshot(self) -> bytes:
        """Return the last route."""
        return pack(last=self._last)

    def restore(self, snapshot: bytes) -> None:
        """Take over the last route."""
        self._last = unpack(snapshot)["last"]

    def _search(self, belief: Belief, goal: F64, wanted: Goal) -> tuple[F64, float]:
        """Return path, shape (n, 2), empty when blocked, and remainder [m]."""
        grid = cost_grid(belief, self._settings, self._radius_m)
        lattice = grid.lattice
        robot = np.array([belief.odom_from_base.x, belief.odom_from_base.y])
        (start_row,), (start_column,) = lattice.cell_of(robot[None])
        if not (0 <= start_row < lattice.rows and 0 <= start_column < lattice.columns):
            return no_path(), 0.0
        cost = self._with_loyalty(grid)
        distance = cheapest(cost, (start_row, start_column), lattice.cell_m)
        target, remainder_m = _choose_target(lattice, distance, goal, max(wanted.tolerance_m, lattice.cell_m))
        straight_m = float(np.hypot(*(goal - robot)))
        if not distance[target] + remainder_m <= straight_m + self._settings.detour_limit_m:
            return no_path(), 0.0
        cells = way_to(target, distance, cost, lattice.cell_m)[:, ::-1].astype(np.float64)
        path = np.array([lattice.x_m, lattice.y_m]) + (pull_straight(cells, grid.cost) + 0.5) * lattice.cell_m
        path[0] = robot
        if remainder_m < lattice.cell_m:  # the goal's own cell
            path = np.concatenate((path[: max(1, len(path) - 1)], goal[None]))
            remainder_m = 0.0
        return resample(path, lattice.cell_m), remainder_m

    def _with_loyalty(self, grid: CostGrid) -> F64:
        """Return the costs, less near the last route: of two ways nearly as good, the one taken stays the better."""
        if len(self._last) == 0:
            return grid.cost
        lattice, reach = grid.lattice, int(self._settings.loyalty_radius_m / grid.lattice.cell_m)
        rows, columns = lattice.cell_of(self._last)
        near = near_cells(rows, columns, reach, lattice.rows, lattice.columns)
        return np.where(near, grid.cost * (1.0 - self._settings.loyalty), grid.cost)


def _choose_target(lattice: Lattice, distance: F64, goal: F64, tolerance_m: float) -> tuple[tuple[int, int], float]:
    """Return the cell to go to and what remains from there [m]; its distance is infinite when there is none."""
    (row,), (column,) = lattice.cell_of(goal[None])
    if 0 <= row < lattice.rows and 0 <= column < lattice.columns:
        return _nearest_to(lattice, distance, goal, tolerance_m)
    rows, columns, side = ring(lattice.rows, lattice.columns)
    border = lattice.centres(rows, columns)
    low, high = lattice.centres(np.array([0, lattice.rows - 1]), np.array([0, lattice.columns - 1]))
    remainder = remainder_outside(border, side, low, high, goal)
    best = int(np.argmin(distance[rows, columns] + remainder))
    return (int(rows[best]), int(columns[best])), float(remainder[best])


def _nearest_to(lattice: Lattice, distance: F64, goal: F64, tolerance_m: float) -> tuple[tuple[int, int], float]:
    """Return, of the cells within the tolerance of the goal that can be reached, the nearest, and what remains from there [m]."""
    rows, columns, remainder = around(lattice, goal, tolerance_m)
    eligible = np.isfinite(distance[rows, columns]) & (remainder <= tolerance_m)
    row, column = np.unravel_index(np.argmin(np.where(eligible, remainder, np.inf)), remainder.shape)
    cell = int(rows[row, 0]), int(columns[column])
    return cell, float(remainder[row, column]) if eligible[row, column] else np.inf
