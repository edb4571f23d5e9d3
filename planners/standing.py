"""What stands still as planners want it that lay constraints: signed clearance, thinned boundary points; and tracks as arrays.

A walker is in the grid as well as among the tracks.  Where a planner moves the tracks on, the cells that they fill now would be
a second obstacle that stays behind; `static_field` takes them out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivers.interface.kernel import kernel
from drivers.interface.samples import frozen_array
from estimators.belief import F32, F64, OCCUPIED, Belief, Lattice, Mask, Track
from estimators.clearance import distance_to
from estimators.field_query import sample
from planners import static_field
from planners.static_field import static_cells

_RIM_CELLS = 2.0  # a track's cells may lie this far outside of its disc: the grid is that coarse, and a walker moves on


@dataclass(frozen=True, slots=True)
class StandingWorld:
    """The cells that stand, and how far everything is from them."""

    lattice: Lattice
    occupied: Mask  # (rows, columns)
    clearance_m: F32  # (rows, columns), to the nearest such cell; below 0 behind the outermost of them

    def clearance_at(self, points: F64) -> F64:
        """Return the clearance [m], shape (n,), of points in odom, shape (n, 2)."""
        return sample(self.clearance_m, self.lattice, points)


@dataclass(frozen=True, slots=True)
class Discs:
    """The tracks as arrays, in odom."""

    centre: F64  # (n, 2) [m]
    velocity: F64  # (n, 2) [m/s]
    radius_m: F64  # (n,)

    @classmethod
    def of(cls, tracks: tuple[Track, ...]) -> Discs:
        """Return centres, velocities and radii in the order of the tracks."""
        centre = np.array([track.position_in_odom for track in tracks]).reshape(-1, 2)
        velocity = np.array([track.velocity_in_odom for track in tracks]).reshape(-1, 2)
        return cls(centre, velocity, np.array([track.radius_m for track in tracks]))

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.radius_m)

    def gap_m(self, x: float, y: float) -> float:
        """Return the distance from a point to the nearest disc's edge; infinite when there is none."""
        gaps = np.hypot(self.centre[:, 0] - x, self.centre[:, 1] - y) - self.radius_m
        return float(gaps.min(initial=np.inf))


def standing_world(belief: Belief) -> StandingWorld:
    """Return the belief's grid without the cells that what moves explains."""
    lattice = belief.grid.lattice
    cells = static_cells(belief, _RIM_CELLS * lattice.cell_m)
    occupied = belief.grid.label == OCCUPIED if cells is None else cells
    outside, inside = distance_to(occupied, lattice.cell_m), distance_to(~occupied, lattice.cell_m)
    clearance = np.where(occupied, np.float32(lattice.cell_m) - inside, outside)
    return StandingWorld(lattice, frozen_array(occupied), frozen_array(clearance))


@kernel()
def _enclosed(occupied: Mask, row: int, column: int) -> bool:
    """Return whether all four neighbours of a cell are occupied; one at the lattice's border is not enclosed."""
    rows, columns = occupied.shape
    if not (0 < row < rows - 1 and 0 < column < columns - 1):
        return False
    upright = occupied[row - 1, column] and occupied[row + 1, column]
    return bool(upright and occupied[row, column - 1] and occupied[row, column + 1])


@kernel()
def _near_cells(occupied: Mask, x_m: float, y_m: float, cell_m: float, path: F64, reach_m: float) -> tuple[F64, F64]:
    """Return the outermost occupied cells' centres, shape (m, 2), within reach of the path, and their distances, shape (m,)."""
    rows, columns = occupied.shape
    low_row = max(int(np.floor((path[:, 1].min() - reach_m - y_m) / cell_m)), 0)
    high_row = min(int(np.floor((path[:, 1].max() + reach_m - y_m) / cell_m)), rows - 1)
    low_column = max(int(np.floor((path[:, 0].min() - reach_m - x_m) / cell_m)), 0)
    high_column = min(int(np.floor((path[:, 0].max() + reach_m - x_m) / cell_m)), columns - 1)
    centres, apart, count = np.empty((max(occupied.size, 1), 2)), np.empty(max(occupied.size, 1)), 0
    for row in range(low_row, high_row + 1):
        for column in range(low_column, high_column + 1):
            if not occupied[row, column] or _enclosed(occupied, row, column):
                continue
            x, y = x_m + (column + 0.5) * cell_m, y_m + (row + 0.5) * cell_m
            nearest = np.inf
            for k in range(len(path)):
                nearest = min(nearest, (path[k, 0] - x) ** 2 + (path[k, 1] - y) ** 2)
            if nearest <= reach_m * reach_m:
                centres[count, 0], centres[count, 1], apart[count] = x, y, np.sqrt(nearest)
                count += 1
    return centres[:count].copy(), apart[:count].copy()


@kernel()
def _thin_out(centres: F64, apart: F64, spacing_m: float, most: int) -> F64:
    """Return the nearest centre, the nearest of those at least `spacing_m` from it, and so on, shape (n, 2)."""
    left, chosen, count = apart.copy(), np.empty((most, 2)), 0
    while count < most and len(left) > 0:
        best = np.argmin(left)
        if np.isinf(left[best]):
            break
        chosen[count] = centres[best]
        for i in range(len(left)):
            dx, dy = centres[i, 0] - centres[best, 0], centres[i, 1] - centres[best, 1]
            if dx * dx + dy * dy < spacing_m * spacing_m:
                left[i] = np.inf
        count += 1
    return chosen[:count].copy()


def boundary_points(world: StandingWorld, path: F64, reach_m: float, spacing_m: float, most: int) -> F64:
    """Return centres of standing boundary cells near a path, shape (k, 2) with k > 0, the nearest first, shape (n, 2).

    No two are nearer to each other than `spacing_m`; there are at most `most`.
    """
    lattice = world.lattice
    corner = lattice.x_m, lattice.y_m, lattice.cell_m
    centres, apart = _near_cells(world.occupied, *corner, np.ascontiguousarray(path), reach_m)
    points: F64 = _thin_out(centres, apart, spacing_m, most)
    return points


def warm_up() -> None:
    """Compile the kernels, for arrays that are read-only as those of a `StandingWorld` are."""
    static_field.warm_up(frozen_array(np.zeros((2, 2), np.uint8)))
    occupied = np.zeros((3, 3), np.bool_)
    occupied[1, 1] = True
    world = StandingWorld(Lattice(0.0, 0.0, 1.0, 3, 3), frozen_array(occupied), frozen_array(np.ones((3, 3), np.float32)))
    world.clearance_at(np.zeros((1, 2)))
    boundary_points(world, np.zeros((1, 2)), 5.0, 0.1, 1)
