"""Warehouse squeeze: a narrow aisle between racks, crossed by two aisles in which carts go to and fro.

Source: Han, Zhu, RCSP, section 5.1, the warehouse environment.  The racks hide a cart until the robot is near the crossing, and
pallets narrow the aisle, so that a robot that has come too far has little room left.  Geometry and schedule are ours.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal
from drivers.interface.seeds import stream
from sim_drivers.scenarios.corridor import corridor
from sim_drivers.scenarios.shuttles import Lane, ShuttleSettings, draw_shuttle
from sim_drivers.scene import Mover, Scene, Shape, StaticObstacle

RACKS_X_M = ((1.5, 3.2), (5.0, 6.6), (8.4, 10.0))  # from and to; between them are the crossings
CARTS_X_M = (4.1, 7.5)
GOAL_X_M = 11.2
BEHIND_M, BEYOND_M = 1.5, 1.5  # from start and goal to the walls
RACK_DEPTH_M, RACK_HEIGHT_M = 1.0, 2.0
CART_LENGTH_M, CART_WIDTH_M, CART_HEIGHT_M = 0.8, 0.6, 1.0
PALLET_M, PALLET_LENGTH_M, PALLET_HEIGHT_M = 0.35, 0.8, 0.8  # how far one stands out of a rack
LANE_GAP_M = 0.2  # between a cart and the wall


class WarehouseSqueezeSettings(ShuttleSettings):
    """Three pairs of racks, two crossings, one pallet in each stretch after a crossing."""

    aisle_half_width_m: float = Field(0.9, ge=0.7, le=2.0, description="from the middle to a rack")
    half_width_m: float = Field(3.4, ge=2.9, le=8.0, description="from the middle to a wall")
    goal_tolerance_m: float = Field(0.35, gt=0.0, le=1.0, description="how near the goal counts as reached")
    time_limit_s: float = Field(60.0, gt=0.0, le=600.0, description="when the run is given up")


class WarehouseSqueeze:
    """A narrow aisle between racks, with pallets in it, that carts cross."""

    Settings = WarehouseSqueezeSettings

    def __init__(self, settings: WarehouseSqueezeSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings, rng = self._settings, stream(seed, "warehouse_squeeze")
        walls = corridor(settings.half_width_m, -BEHIND_M, GOAL_X_M + BEYOND_M)
        pallets = tuple(self._pallet(rng, index) for index in range(1, len(RACKS_X_M)))
        movers = tuple(self._cart(rng, index) for index in range(len(CARTS_X_M)))
        goal = Goal(GOAL_X_M, 0.0, tolerance_m=settings.goal_tolerance_m)
        return Scene("warehouse_squeeze", SE2(), (goal,), settings.time_limit_s, (*walls, *self._racks(), *pallets), movers)

    def _racks(self) -> tuple[StaticObstacle, ...]:
        y = self._settings.aisle_half_width_m + 0.5 * RACK_DEPTH_M
        return tuple(
            StaticObstacle(
                f"rack_{index}_{side}", Shape.box(end - start, RACK_DEPTH_M, RACK_HEIGHT_M), SE2((start + end) / 2, sign * y)
            )
            for index, (start, end) in enumerate(RACKS_X_M)
            for side, sign in (("left", 1.0), ("right", -1.0))
        )

    def _pallet(self, rng: np.random.Generator, index: int) -> StaticObstacle:
        """Return the pallet in front of the index-th rack, on the side and at the place that are drawn."""
        start, end = RACKS_X_M[index]
        sign = 1.0 if rng.random() < 0.5 else -1.0
        x = float(rng.uniform(start + 0.5 * PALLET_LENGTH_M, end - 0.5 * PALLET_LENGTH_M))
        place = SE2(x, sign * (self._settings.aisle_half_width_m - 0.5 * PALLET_M))
        return StaticObstacle(f"pallet_{index}", Shape.box(PALLET_LENGTH_M, PALLET_M, PALLET_HEIGHT_M), place)

    def _cart(self, rng: np.random.Generator, index: int) -> Mover:
        x, y = CARTS_X_M[index], self._settings.half_width_m - 0.5 * CART_LENGTH_M - LANE_GAP_M
        shape = Shape.box(CART_LENGTH_M, CART_WIDTH_M, CART_HEIGHT_M)  # its own x axis lies along its lane
        return draw_shuttle(rng, self._settings, f"cart_{index}", shape, Lane((x, -y), (x, y)))
