"""Layer 1 on arrays: how old each cell's observation is, and which cells will be taken on arrival."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import F32, F64, U8, Mask

MOVER_M = 0.8  # cells this near to each other belong to one boundary
LEAST_CELLS = 6  # of one
THICK_M = 0.25  # from the surface of who comes to his middle
LEAST_SLOPE = 0.5  # beside a boundary the clearance rises by a metre in a metre; where cells make it less, it leads nowhere
TURNED = 0.7  # and where the mean of two slopes is less, the one before was another boundary's


class Arrival(NamedTuple):
    """What equation 2 needs besides the field."""

    speed_m_s: float  # that arrivals are expected at
    horizon_max_s: float
    trust_decay_s: float
    confidence_decay_s: float


@kernel()
def observe(
    age_s: F32, known: Mask, corner: F64, cell_m: float, pose: F64, half_fov_rad: float, ranges_m: tuple[float, float, float],
    dt_s: float,
) -> None:  # fmt: skip
    """Let observations, shape (rows, columns) [s], grow older by dt_s, and those in the sector of view be new.

    `ranges_m` are the ground that the robot stands on, where the sector begins, and where it ends.
    """
    body_m, near_m, range_m = ranges_m
    cosine, c, s = np.cos(half_fov_rad), np.cos(pose[2]), np.sin(pose[2])
    for row in range(age_s.shape[0]):
        y = corner[1] + (row + 0.5) * cell_m - pose[1]
        for column in range(age_s.shape[1]):
            x = corner[0] + (column + 0.5) * cell_m - pose[0]
            distance2 = x * x + y * y
            seen = near_m * near_m <= distance2 <= range_m * range_m and c * x + s * y >= cosine * np.sqrt(distance2)
            seen = known[row, column] and (seen or distance2 <= body_m * body_m)
            age_s[row, column] = np.float32(0.0) if seen else age_s[row, column] + np.float32(dt_s)


@kernel()
def taken_on_arrival(clearance: F32, rate: F32, age_s: F32, corner: F64, cell_m: float, robot: F64, arrival: Arrival) -> U8:
    """Return 1 where there is clearance now and equation 2 leaves none, 0 elsewhere, shape (rows, columns).

    Source: Cui, Deng, Wang, equation 2: clearance + h c c_pred rate, with h the time to get there, c the confidence in an
    observation of this age and c_pred the trust in a rate over h.
    """
    taken = np.zeros(clearance.shape, np.uint8)
    for row in range(clearance.shape[0]):
        y = corner[1] + (row + 0.5) * cell_m - robot[1]
        for column in range(clearance.shape[1]):
            value, change = clearance[row, column], rate[row, column]
            if change < 0.0 < value:
                x = corner[0] + (column + 0.5) * cell_m - robot[0]
                h = min(np.sqrt(x * x + y * y) / arrival.speed_m_s, arrival.horizon_max_s)
                confidence = np.exp(-age_s[row, column] / arrival.confidence_decay_s)
                trust = arrival.trust_decay_s / (arrival.trust_decay_s + h)
                taken[row, column] = value + h * confidence * trust * change <= 0.0
    return taken


@kernel()
def nearest_closing(
    clearance: F32, rate: F32, recent: F32, window_s: float, corner: F64, cell_m: float, robot: F64, closing_m_s: float, most: int
) -> F64:
    """Return what closes in, nearest to the robot first: middle in odom, velocity, number of cells, shape (n, 5).

    Around a boundary that moves with velocity v the field changes by -grad . v; v is the least-squares fit of that over the
    cells beside it, so that it needs no obstacle, only slopes and rates.  A rate over some time goes with the slope in the
    middle of it: beside who comes the slope turns, and with the last one he seems to come to that side.  Its middle lies
    `THICK_M` behind its surface: of the surface only the part counts that is seen and has nothing else near, often one side.

    Args:
        clearance: shape (rows, columns) [m].
        rate: shape (rows, columns) [m/s], smoothed: it says which cells lie beside what closes in.
        recent: likewise, as it was of late (`RecentRate`), for the velocity; NaN where nothing is known of it.
        window_s: the time that it was taken over.
        corner: lower corner of the lattice in odom, shape (2,).
        cell_m: size of a cell.
        robot: in odom, shape (2,).
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
            away_m[left] = np.hypot(x - robot[0], y - robot[1]) if change < 0.0 else np.inf
            left += 1
    out, count = np.zeros((most, 5)), 0
    while count < most and left > 0:
        nearest = np.argmin(away_m[:left])
        if away_m[nearest] == np.inf:
            break
        near_x, near_y = corner[0] + (at[nearest, 1] + 0.5) * cell_m, corner[1] + (at[nearest, 0] + 0.5) * cell_m
        out[count] = _boundary(clearance, rate, recent, window_s, corner, cell_m, at[:left], near_x, near_y)
        others = 0
        for i in range(left):
            x, y = corner[0] + (at[i, 1] + 0.5) * cell_m, corner[1] + (at[i, 0] + 0.5) * cell_m
            if min(np.hypot(x - near_x, y - near_y), np.hypot(x - out[count, 0], y - out[count, 1])) > MOVER_M:
                at[others, 0], at[others, 1], away_m[others] = at[i, 0], at[i, 1], away_m[i]
                others += 1
        left = others
        if out[count, 4] >= LEAST_CELLS:
            count += 1
    return out[:count]


@kernel()
def _boundary(
    clearance: F32,
    rate: F32,
    recent: F32,
    window_s: float,
    corner: F64,
    cell_m: float,
    at: NDArray[np.int64],
    near_x: float,
    near_y: float,
) -> F64:
    """Return the boundary around a place, fitted to those of the cells `at`, shape (n, 2), that lie beside it; shape (5,)."""
    out = np.zeros(5)
    a, b, d, e, f = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(at)):
        row, column = at[i]
        x, y = corner[0] + (column + 0.5) * cell_m, corner[1] + (row + 0.5) * cell_m
        if (x - near_x) ** 2 + (y - near_y) ** 2 > MOVER_M * MOVER_M:
            continue
        slope_x = (clearance[row, column + 1] - clearance[row, column - 1]) / (2.0 * cell_m)
        slope_y = (clearance[row + 1, column] - clearance[row - 1, column]) / (2.0 * cell_m)
        inside = clearance[row, column] + THICK_M / max(np.hypot(slope_x, slope_y), LEAST_SLOPE)
        out[0] += x - slope_x * inside
        out[1] += y - slope_y * inside
        out[4] += 1.0
        change = recent[row, column] if np.isfinite(recent[row, column]) else rate[row, column]
        half_s = 0.25 * window_s / cell_m
        mean_x = slope_x - half_s * (recent[row, column + 1] - recent[row, column - 1])
        mean_y = slope_y - half_s * (recent[row + 1, column] - recent[row - 1, column])
        if np.hypot(mean_x, mean_y) > TURNED:
            slope_x, slope_y = mean_x, mean_y
        a, b, d = a + slope_x * slope_x, b + slope_x * slope_y, d + slope_y * slope_y
        e, f = e - slope_x * change, f - slope_y * change
    if out[4] > 0.0:
        out[0], out[1] = out[0] / out[4], out[1] / out[4]
        a, d = a + 0.05 * out[4], d + 0.05 * out[4]
        determinant = a * d - b * b
        out[2], out[3] = (d * e - b * f) / determinant, (a * f - b * e) / determinant
    return out
