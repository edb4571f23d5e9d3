"""What of the surroundings moves and what stands still: the tracks that are planned around, and the grid without them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from drivers.interface.samples import frozen_array
from estimators.belief import F32, F64, OCCUPIED, Belief, Lattice, Mask, Track
from estimators.field_query import sample
from planners.risk import extremes

STILL_M_S = 0.2  # slower is within what a tracker makes of a post that the robot drives past
GRID_M = 0.1  # a disc this near to occupied cells is in the grid
CERTAIN_M = 0.5  # standard deviation beyond which a track does not say which cells are its own


def movers(belief: Belief) -> tuple[Track, ...]:
    """Return the tracks that a planner has to reckon with: all but those that hardly move and stand in the grid anyway."""
    still = [track for track in belief.tracks if math.hypot(*track.velocity_in_odom) < STILL_M_S]
    if not still:
        return belief.tracks
    field, centres = belief.clearance, np.array([track.position_in_odom for track in still])
    away_m = sample(field.clearance_m, field.lattice, np.nan_to_num(centres, nan=np.inf))
    known = {id(track) for track, m in zip(still, away_m, strict=True) if m <= track.radius_m + GRID_M}
    return tuple(track for track in belief.tracks if id(track) not in known)


def static_cells(belief: Belief, margin_m: float) -> Mask | None:
    """Return which cells are occupied and explained by no track, shape (rows, columns); None: no track explains any.

    A track explains the cells within its radius and the margin: it has a future of its own, and where it stood a moment ago is
    free when it has gone.  One that is not certain enough explains none.
    """
    discs = _discs(movers(belief), margin_m)
    if not discs.size:
        return None
    lattice = belief.grid.lattice
    cells: Mask = _without(belief.grid.label, discs, lattice.x_m, lattice.y_m, lattice.cell_m)
    return cells


def static_clearance(belief: Belief, margin_m: float, far_m: float) -> F32:
    """Return the distance from each cell to the nearest of the `static_cells`, shape (rows, columns) [m], exact up to `far_m`.

    What is farther away may be so by any amount.
    """
    cells, cell_m = static_cells(belief, margin_m), belief.grid.lattice.cell_m
    return belief.clearance.clearance_m if cells is None else _near(cells, far_m, cell_m)


def _near(occupied: Mask, far_m: float, cell_m: float) -> F32:
    """Return the distance from each cell to the nearest occupied one, shape (rows, columns) [m], exact up to `far_m`."""
    distance_m: F32 = near_distance(occupied, math.ceil(far_m / cell_m) + 2, cell_m)
    return distance_m


@dataclass(frozen=True, slots=True)
class Surroundings:
    """A window of the grid and what stands still in it."""

    lattice: Lattice
    clearance_m: F32  # (rows, columns), as of `static_clearance`, exact up to the distance that was asked for
    label: NDArray[np.uint8]  # (rows, columns)


def surroundings(
    belief: Belief, margin_m: float, reach_m: float, far_m: float, moving: tuple[Track, ...] | None = None
) -> Surroundings:
    """Return the static clearance where it is needed: within `reach_m` of the robot and up to `far_m`.

    It is that of `static_clearance` there, for a fraction of the time; what is farther away than `far_m` may be so by any
    amount.  `moving`: the tracks whose cells are taken out, where they are not the `movers`.
    """
    grid, cell_m, pose = belief.grid.lattice, belief.grid.lattice.cell_m, belief.odom_from_base
    half = math.ceil(min(float(max(grid.rows, grid.columns)), (reach_m + far_m) / cell_m)) + 2
    top, bottom = _span((pose.y - grid.y_m) / cell_m, half, grid.rows)
    left, right = _span((pose.x - grid.x_m) / cell_m, half, grid.columns)
    lattice = Lattice(grid.x_m + left * cell_m, grid.y_m + top * cell_m, cell_m, bottom - top, right - left)
    label = belief.grid.label[top:bottom, left:right].copy()
    discs = _discs(movers(belief) if moving is None else moving, margin_m)
    if not discs.size:
        return Surroundings(lattice, belief.clearance.clearance_m[top:bottom, left:right].copy(), label)
    occupied: Mask = _without(label, discs, lattice.x_m, lattice.y_m, cell_m)
    return Surroundings(lattice, _near(occupied, far_m, cell_m), label)


def _span(centre: float, half: int, count: int) -> tuple[int, int]:
    """Return first and last but one of the indices around a centre, which is clamped to 0 to `count`; of no place all."""
    if not math.isfinite(centre):
        return 0, count
    at = int(min(max(centre, 0.0), count - 1.0))
    return max(0, at - half), min(count, at + half + 1)


def _discs(moving: tuple[Track, ...], margin_m: float) -> F64:
    """Return x, y and radius of what the tracks explain, shape (n, 3)."""
    return np.array([(*track.position_in_odom, track.radius_m + margin_m) for track in moving if _certain(track)])


def warm_up(label: NDArray[np.uint8]) -> None:
    """Compile the kernels for labels as a belief holds them."""
    sample(frozen_array(np.ones((2, 2), np.float32)), Lattice(0.0, 0.0, 1.0, 2, 2), np.zeros((1, 2)))
    for cells in (label, label.copy()):
        near_distance(_without(cells, np.zeros((1, 3)), 0.0, 0.0, 1.0), 1, 1.0)


def _certain(track: Track) -> bool:
    x, y = track.position_in_odom
    variance = max(track.covariance[0, 0], track.covariance[1, 1])
    return math.isfinite(x) and math.isfinite(y) and math.isfinite(track.radius_m) and variance <= CERTAIN_M**2


@kernel()
def _without(label: NDArray[np.uint8], discs: F64, x_m: float, y_m: float, cell_m: float) -> Mask:
    """Return which cells are occupied outside of the discs (x, y, radius), shape (n, 3)."""
    occupied: Mask = label == OCCUPIED
    rows, columns = label.shape
    for d in range(len(discs)):
        x, y, radius = discs[d, 0] - x_m, discs[d, 1] - y_m, discs[d, 2]
        for row in range(max(0, int((y - radius) / cell_m)), min(rows, int((y + radius) / cell_m) + 1)):
            for column in range(max(0, int((x - radius) / cell_m)), min(columns, int((x + radius) / cell_m) + 1)):
                dx, dy = (column + 0.5) * cell_m - x, (row + 0.5) * cell_m - y
                if dx * dx + dy * dy <= radius * radius:
                    occupied[row, column] = False
    return occupied


@kernel(fast=True)
def near_distance(occupied: Mask, most: int, cell_m: float) -> F32:
    """Return the distance [m] from each cell's centre to that of the nearest occupied one, `most` cells at most.

    Exact, and the same as `estimators.clearance.distance_to` up to there: distances along the columns, then along each row the
    least of their squares plus the squares of the steps to them.

    Source: Saito, Toriwaki, New algorithms for Euclidean distance transformation of an n-dimensional digitized picture with
    applications, Pattern Recognition 27(11), 1994; with a bounded search.
    """
    rows, columns = occupied.shape
    bound, one = np.float32(most), np.float32(1.0)
    along, distance = np.empty((rows, columns), np.float32), np.empty((rows, columns), np.float32)
    squared, least = np.full(columns + 2 * most, bound * bound), np.empty(columns, np.float32)  # with nothing beyond the edges
    for r in range(rows):
        before, here = along[r - 1] if r > 0 else squared[:columns], along[r]
        for c in range(columns):
            further = before[c] + one
            further = further if further < bound else bound
            here[c] = np.float32(0.0) if occupied[r, c] else further
    for r in range(rows - 2, -1, -1):
        below, here = along[r + 1], along[r]
        for c in range(columns):
            further = below[c] + one
            here[c] = here[c] if here[c] < further else further
    for r in range(rows):
        for c in range(columns):
            squared[most + c] = along[r, c] * along[r, c]
        least[:] = squared[most : most + columns]
        if extremes(least)[0] == bound * bound:
            distance[r] = bound * np.float32(cell_m)
            continue
        for step in range(1, most):
            left, right, more = squared[most - step :], squared[most + step :], np.float32(step * step)
            for c in range(columns):
                d = (left[c] if left[c] < right[c] else right[c]) + more
                least[c] = least[c] if least[c] < d else d
        for c in range(columns):
            distance[r, c] = np.sqrt(least[c]) * np.float32(cell_m)
    return distance
