"""The shortest way through all that stands in a scene, for who knows it: what success weighted by path length needs."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planners.polyline import arc_length
from planners.routers.grid_kernels import pull_straight
from planners.routers.grid_search import cheapest, way_to
from runtime.floor_plan import FloorPlan
from sim_drivers.scene import Scene

F64 = NDArray[np.float64]
CELL_M = 0.05
MARGIN_M = 1.0  # searched beyond a disc that touches what stands


def shortest_way_m(scene: Scene, radius_m: float) -> float:
    """Return the length of the shortest way that a disc has from the start through all goals, each up to its tolerance [m].

    Found on a grid of 5 cm and pulled straight; what moves is left out.  Infinite where there is none, zero without goals.
    """
    start = scene.map_from_start
    places = [(start.x, start.y), *((goal.x_m, goal.y_m) for goal in scene.goals)]
    free = _Free(scene, np.array(places), radius_m)
    legs = [free.way_m(place, goal) for place, goal in pairwise(places)]
    return sum(max(0.0, leg - goal.tolerance_m) for leg, goal in zip(legs, scene.goals, strict=True))


class _Free:
    """Where the middle of a disc may be."""

    def __init__(self, scene: Scene, places: F64, radius_m: float) -> None:
        solids = tuple((obstacle.shape, obstacle.map_from_shape) for obstacle in scene.static)
        reaches = np.array([(pose.x, pose.y, shape.bounding_radius_m) for shape, pose in solids]).reshape(-1, 3)
        low = np.vstack((places, reaches[:, :2] - reaches[:, 2:])).min(axis=0) - radius_m - MARGIN_M
        high = np.vstack((places, reaches[:, :2] + reaches[:, 2:])).max(axis=0) + radius_m + MARGIN_M
        columns, rows = np.ceil((high - low) / CELL_M).astype(int).tolist()
        self._corner = low
        self._cost = np.ones((rows, columns))
        for (x, y, bounding_m), solid in zip(reaches.tolist(), solids, strict=True):
            self._block(FloorPlan((solid,)), np.array([x, y]), bounding_m + radius_m, radius_m)

    def _block(self, plan: FloorPlan, middle: F64, within_m: float, radius_m: float) -> None:
        """Block the places that are too near to one solid, all of which lie within a square around its middle."""
        first, last = (np.rint((middle + side * within_m - self._corner) / CELL_M).astype(int) for side in (-1, 1))
        columns, rows = (np.arange(a, b + 1) for a, b in zip(np.maximum(first, 0), last, strict=True))
        x, y = np.meshgrid(self._corner[0] + CELL_M * columns, self._corner[1] + CELL_M * rows)
        near = plan.distance_m(np.stack((x, y), axis=-1).reshape(-1, 2)).reshape(x.shape) < radius_m
        self._cost[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1][near] = np.inf

    def way_m(self, start: tuple[float, float], goal: tuple[float, float]) -> float:
        here, there = self._cell(start), self._cell(goal)
        distance = cheapest(self._cost, here, CELL_M)
        if not math.isfinite(distance[there]):
            return math.inf
        cells = way_to(there, distance, self._cost, CELL_M)[:, ::-1].astype(np.float64)
        return float(arc_length(pull_straight(cells, self._cost))[-1]) * CELL_M

    def _cell(self, place: tuple[float, float]) -> tuple[int, int]:
        column, row = np.rint((np.array(place) - self._corner) / CELL_M).astype(int).tolist()
        return row, column
