"""What of the surroundings moves and what stands still: the tracks that are planned around, and the grid without them."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drivers.interface.samples import frozen_array
from estimators.belief import F32, F64, OCCUPIED, Belief, Lattice, Mask, Track
from estimators.clearance import distance_to
from estimators.field_query import sample

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


def static_clearance(belief: Belief, margin_m: float) -> F32:
    """Return the distance from each cell to the nearest occupied one that no track explains, shape (rows, columns) [m].

    A track explains the cells within its radius and the margin: it has a future of its own, and where it stood a moment ago is
    free when it has gone.  One that is not certain enough explains none.
    """
    discs = np.array([(*track.position_in_odom, track.radius_m + margin_m) for track in movers(belief) if _certain(track)])
    if not discs.size:
        return belief.clearance.clearance_m
    lattice = belief.grid.lattice
    occupied: Mask = _without(belief.grid.label, discs, lattice.x_m, lattice.y_m, lattice.cell_m)
    return distance_to(occupied, lattice.cell_m)


def warm_up(label: NDArray[np.uint8]) -> None:
    """Compile the kernels for labels as a belief holds them."""
    sample(frozen_array(np.ones((2, 2), np.float32)), Lattice(0.0, 0.0, 1.0, 2, 2), np.zeros((1, 2)))
    _without(label, np.zeros((1, 3)), 0.0, 0.0, 1.0)


def _certain(track: Track) -> bool:
    x, y = track.position_in_odom
    variance = max(track.covariance[0, 0], track.covariance[1, 1])
    return math.isfinite(x) and math.isfinite(y) and math.isfinite(track.radius_m) and variance <= CERTAIN_M**2


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
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
