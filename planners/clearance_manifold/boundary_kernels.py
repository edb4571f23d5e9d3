"""Boundaries that close in: where they are, and how fast, as far as the field shows it; no obstacle is needed for that."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import F32, F64
from planners.clearance_manifold.sight_kernels import in_sight

MOVER_M = 0.8  # cells this near to each other belong to one boundary
LEAST_CELLS = 6  # of one
THICK_M = 0.25  # from the surface of who comes to his middle
LEAST_SLOPE = 0.5  # beside a boundary the clearance rises by a metre in a metre; where cells make it less, it leads nowhere
TURNED = 0.7  # and where the mean of two slopes is less, the one before was another boundary's
FASTEST_M_S = 1.5  # nobody walks faster: a clearance that falls by more was another boundary's before
RIDGE = 1e-3  # keeps the fit solvable where all slopes lead the same way

# What is found is a row: middle in odom [m], velocity [m/s], number of cells; the mean products xx, xy, yy of the slopes that the
# velocity was fitted to (0: to none, it is not known), and of where single cells say that the middle is, from that [m2]; and the
# share of the cells that it was fitted to.
CELLS, SLOPES, SCATTER, SHARE, FOUND = 4, 5, 8, 11, 12


@kernel()
def nearest_closing(
    clearance: F32,
    rate: F32,
    recent: F32,
    window_s: float,
    corner: F64,
    cell_m: float,
    sights: F64,
    closing_m_s: float,
    most: int,
) -> F64:
    """Return what closes in, nearest to the robot first, shape (n, FOUND).

    Args:
        clearance: shape (rows, columns) [m].
        rate: shape (rows, columns) [m/s], smoothed: it says which cells lie beside what closes in.
        recent: likewise, as it was of late (`RecentRate`), for the velocity; NaN where nothing is known of it.
        window_s: the time that it was taken over.
        corner: lower corner of the lattice in odom, shape (2,).
        cell_m: size of a cell.
        sights: what was in view now and a window ago (`in_sight`), shape (2, 8).
        closing_m_s: slower boundaries are not looked at.
        most: n at most.
    """
    rows, columns = clearance.shape
    left, at, away_m = 0, np.empty((rows * columns, 2), np.int64), np.empty(rows * columns)
    for row in range(1, rows - 1):
        for column in range(1, columns - 1):
            change = rate[row, column]
            if change == 0.0 or abs(change) < closing_m_s or not 0.0 < clearance[row, column] <= 5.0 * cell_m:
                continue
            x, y = corner[0] + (column + 0.5) * cell_m, corner[1] + (row + 0.5) * cell_m
            at[left, 0], at[left, 1] = row, column
            away_m[left] = np.hypot(x - sights[0, 0], y - sights[0, 1]) if change < 0.0 else np.inf
            left += 1
    out, count = np.zeros((most, FOUND)), 0
    while count < most and left > 0:
        nearest = np.argmin(away_m[:left])
        if away_m[nearest] == np.inf:
            break
        near_x, near_y = corner[0] + (at[nearest, 1] + 0.5) * cell_m, corner[1] + (at[nearest, 0] + 0.5) * cell_m
        out[count] = _boundary(clearance, recent, window_s, corner, cell_m, at[:left], near_x, near_y, sights)
        others = 0
        for i in range(left):
            x, y = corner[0] + (at[i, 1] + 0.5) * cell_m, corner[1] + (at[i, 0] + 0.5) * cell_m
            if min(np.hypot(x - near_x, y - near_y), np.hypot(x - out[count, 0], y - out[count, 1])) > MOVER_M:
                at[others, 0], at[others, 1], away_m[others] = at[i, 0], at[i, 1], away_m[i]
                others += 1
        left = others
        if out[count, CELLS] >= LEAST_CELLS:
            count += 1
    return out[:count]


@kernel()
def _boundary(
    clearance: F32, recent: F32, window_s: float, corner: F64, cell_m: float, at: NDArray[np.int64], near_x: float, near_y: float,
    sights: F64,
) -> F64:  # fmt: skip
    """Return the boundary around a place, of those of the cells `at`, shape (n, 2), that lie beside it; shape (FOUND,)."""
    beside, count = np.empty_like(at), 0
    for i in range(len(at)):
        x, y = corner[0] + (at[i, 1] + 0.5) * cell_m, corner[1] + (at[i, 0] + 0.5) * cell_m
        if (x - near_x) ** 2 + (y - near_y) ** 2 <= MOVER_M * MOVER_M:
            beside[count, 0], beside[count, 1] = at[i, 0], at[i, 1]
            count += 1
    out = np.zeros(FOUND)
    if count > 0:
        _place(out, clearance, corner, cell_m, beside[:count], sights[0])
        _velocity(out, clearance, recent, window_s, corner, cell_m, beside[:count], sights)
    return out


@kernel()
def _place(out: F64, clearance: F32, corner: F64, cell_m: float, at: NDArray[np.int64], sight: F64) -> None:
    """Write down where the middle of a boundary is, by the cells `at` beside it, shape (n, 2), and how far those agree.

    It lies `THICK_M` behind its surface: of the surface only the part counts that is in view and has nothing else near, often
    one side.
    """
    seen, every = np.zeros(6), np.zeros(6)
    for i in range(len(at)):
        row, column = at[i]
        x, y = corner[0] + (column + 0.5) * cell_m, corner[1] + (row + 0.5) * cell_m
        slope_x, slope_y = _slope(clearance, row, column, cell_m)
        inside = clearance[row, column] + THICK_M / max(np.hypot(slope_x, slope_y), LEAST_SLOPE)
        middle_x, middle_y = x - slope_x * inside, y - slope_y * inside
        _add(every, middle_x, middle_y)
        if in_sight(x, y, clearance[row, column], sight):
            _add(seen, middle_x, middle_y)
    best = seen if seen[0] >= LEAST_CELLS else every
    out[0], out[1], out[CELLS] = best[1] / best[0], best[2] / best[0], every[0]
    out[SCATTER] = best[3] / best[0] - out[0] * out[0]
    out[SCATTER + 1] = best[4] / best[0] - out[0] * out[1]
    out[SCATTER + 2] = best[5] / best[0] - out[1] * out[1]


@kernel()
def _velocity(
    out: F64, clearance: F32, recent: F32, window_s: float, corner: F64, cell_m: float, at: NDArray[np.int64], sights: F64
) -> None:
    """Write down how fast a boundary moves, by the cells `at` beside it, shape (n, 2), that it came nearer to.

    Around a boundary that moves with velocity v the field changes by -grad . v; v is the least-squares fit of that.  A rate over
    some time goes with the slope in the middle of it: beside who comes the slope turns, and with the last one he seems to come
    to that side.  A clearance that the view bounded, now or then, says nothing: who comes into view has any rate.
    """
    slopes, e, f = np.zeros(6), 0.0, 0.0
    half_s = 0.25 * window_s / cell_m
    for i in range(len(at)):
        row, column = at[i]
        x, y = corner[0] + (column + 0.5) * cell_m, corner[1] + (row + 0.5) * cell_m
        now, change = clearance[row, column], recent[row, column]
        if not -FASTEST_M_S <= change < 0.0:
            continue
        if not (in_sight(x, y, now, sights[0]) and in_sight(x, y, now - window_s * change, sights[1])):
            continue
        slope_x, slope_y = _slope(clearance, row, column, cell_m)
        mean_x = slope_x - half_s * (recent[row, column + 1] - recent[row, column - 1])
        mean_y = slope_y - half_s * (recent[row + 1, column] - recent[row - 1, column])
        if np.hypot(mean_x, mean_y) > TURNED:
            slope_x, slope_y = mean_x, mean_y
        _add(slopes, slope_x, slope_y)
        e, f = e - slope_x * change, f - slope_y * change
    if slopes[0] >= LEAST_CELLS:
        a, b, d = slopes[3] + RIDGE * slopes[0], slopes[4], slopes[5] + RIDGE * slopes[0]
        determinant = a * d - b * b
        out[2], out[3] = (d * e - b * f) / determinant, (a * f - b * e) / determinant
        out[SLOPES : SLOPES + 3] = slopes[3:] / slopes[0]
        out[SHARE] = slopes[0] / len(at)


@kernel(inline=True)
def _slope(clearance: F32, row: int, column: int, cell_m: float) -> tuple[float, float]:
    """Return how the clearance rises along x and y."""
    along_x = (clearance[row, column + 1] - clearance[row, column - 1]) / (2.0 * cell_m)
    return along_x, (clearance[row + 1, column] - clearance[row - 1, column]) / (2.0 * cell_m)


@kernel(inline=True)
def _add(sums: F64, x: float, y: float) -> None:
    """Add a vector to a number of them, their sum, and the sums of xx, xy and yy; shape (6,)."""
    sums[0] += 1.0
    sums[1] += x
    sums[2] += y
    sums[3] += x * x
    sums[4] += x * y
    sums[5] += y * y
