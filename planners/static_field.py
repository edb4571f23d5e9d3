"""The clearance to what stands still: the grid's obstacles without those that are tracked."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from estimators.belief import F32, F64, OCCUPIED, Belief, Mask, Track
from estimators.clearance import distance_to

CERTAIN_M = 0.5  # standard deviation beyond which a track does not say which cells are its own


def static_clearance(belief: Belief, margin_m: float) -> F32:
    """Return the distance from each cell to the nearest occupied one that no track explains, shape (rows, columns) [m].

    A track explains the cells within its radius and the margin: it has a future of its own, and where it stood a moment ago is
    free when it has gone.  One that is not certain enough explains none.
    """
    discs = np.array([(*track.position_in_odom, track.radius_m + margin_m) for track in belief.tracks if _certain(track)])
    if not discs.size:
        return belief.clearance.clearance_m
    lattice = belief.grid.lattice
    occupied: Mask = _without(belief.grid.label, discs, lattice.x_m, lattice.y_m, lattice.cell_m)
    return distance_to(occupied, lattice.cell_m)


def warm_up(label: NDArray[np.uint8]) -> None:
    """Compile the kernel for labels as a belief holds them."""
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
