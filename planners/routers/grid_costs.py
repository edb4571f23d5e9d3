"""What a cell costs to cross, on a coarser lattice whose cells keep their place in odom while the window rolls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.settings import Settings
from estimators.belief import UNKNOWN, Belief, Lattice
from planners.routers.window import around
from planners.static_field import static_clearance

F64 = NDArray[np.float64]

_OWN_M = 0.1  # occupied cells this near to a track's disc are its own


class GridCosts(Settings):
    """How dear nearness and ignorance are; a metre through known, open space costs 1."""

    cell_m: float = Field(0.10, gt=0.0, le=1.0, description="cell that is searched, a multiple of the belief's cell")
    margin_m: float = Field(0.10, ge=0.0, le=1.0, description="kept free beyond the robot's radius")
    comfort_m: float = Field(0.40, gt=0.0, le=5.0, description="nearness costs extra up to this far beyond the margin")
    nearness_cost: float = Field(4.0, ge=0.0, le=100.0, description="extra cost of a metre right at the margin")
    unknown_cost: float = Field(0.3, ge=0.0, le=100.0, description="extra cost of a metre through unknown cells")
    escape_m: float = Field(0.35, ge=0.0, le=2.0, description="this near the robot, the margin is dear but not forbidden")
    through_movers: bool = Field(
        False, description="tracked obstacles that move do not block: passing them is the planner's business"
    )
    escape_cost: float = Field(20.0, ge=0.0, le=1000.0, description="extra cost of a metre inside the margin there")


@dataclass(frozen=True, slots=True)
class CostGrid:
    """Cost per metre of every coarse cell; infinite where the robot does not fit."""

    lattice: Lattice
    cost: F64  # (rows, columns)


def _blocks(field: NDArray[Any], top: int, left: int, rows: int, columns: int, factor: int) -> F64:
    """Return the means of blocks of `factor` by `factor` cells, shape (rows, columns)."""
    total = np.zeros((rows, columns))
    for down in range(factor):
        for right in range(factor):
            total += field[top + down : top + rows * factor : factor, left + right : left + columns * factor : factor]
    return total / factor**2


def cost_grid(belief: Belief, settings: GridCosts, robot_radius_m: float) -> CostGrid:
    """Return the costs; clearance is averaged over a coarse cell, which is its value at the centre where it is linear."""
    fine = belief.grid.lattice
    factor = max(1, round(settings.cell_m / fine.cell_m))
    top, left = (-round(corner / fine.cell_m) % factor for corner in (fine.y_m, fine.x_m))
    rows, columns = (fine.rows - top) // factor, (fine.columns - left) // factor
    cell_m = factor * fine.cell_m
    lattice = Lattice(fine.x_m + left * fine.cell_m, fine.y_m + top * fine.cell_m, cell_m, rows, columns)
    dear_m = robot_radius_m + settings.margin_m + settings.comfort_m  # farther off, nearness costs nothing
    far_m = dear_m + 2.0 * cell_m  # so that no block which is dear in part has a cell that is farther away
    clearance_m = static_clearance(belief, _OWN_M, far_m) if settings.through_movers else belief.clearance.clearance_m
    gap_m = _blocks(clearance_m, top, left, rows, columns, factor) - robot_radius_m - settings.margin_m
    unknown = _blocks(belief.grid.label == UNKNOWN, top, left, rows, columns, factor) > 0.5

    cost = 1.0 + settings.unknown_cost * unknown
    cost += settings.nearness_cost * np.clip(1.0 - gap_m / settings.comfort_m, 0.0, 1.0) ** 2
    robot = np.array([belief.odom_from_base.x, belief.odom_from_base.y])
    near_rows, near_columns, away_m = around(lattice, robot, settings.escape_m)
    near = np.zeros((rows, columns), np.bool_)
    near[near_rows, near_columns] = away_m < settings.escape_m
    inside_margin = gap_m < 0.0
    cost[inside_margin & near] += settings.escape_cost
    occupied = gap_m <= -robot_radius_m - settings.margin_m
    cost[(inside_margin & ~near) | occupied] = np.inf
    return CostGrid(lattice, np.asarray(cost, dtype=np.float64))
