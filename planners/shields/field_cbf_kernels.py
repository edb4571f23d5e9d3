"""Boundary samples and constraints of the field-CBF, read from the clearance field; arrays in, arrays out."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
Mask = NDArray[np.bool_]

MIN_SLOPE = 0.5  # a distance field rises by 1 per metre; where much less is left, two boundaries cancel (medial axis)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def boundary_of(field: F32, row: int, column: int, cell_m: float, x: float, y: float) -> tuple[float, float, float, float]:
    """Project a cell onto its nearest boundary and look at it from the robot.

    Args:
        field: clearance [m], shape (rows, columns).
        row: of the cell.
        column: of the cell.
        cell_m: size of a cell.
        x: of the robot, seen from the cell's centre [m].
        y: likewise.

    Returns:
        Vector from the boundary point to the robot (x, y) [m], distance [m] and slope of the field; the distance is infinite
        where the boundary cannot be told or turns its back on the robot, as the far side of a pillar does, whose rate
        is not the rate of what faces the robot.
    """
    rows, columns = field.shape
    if not (0 < row < rows - 1 and 0 < column < columns - 1):
        return 0.0, 0.0, np.inf, 0.0
    slope_x = (field[row, column + 1] - field[row, column - 1]) / (2.0 * cell_m)
    slope_y = (field[row + 1, column] - field[row - 1, column]) / (2.0 * cell_m)
    slope = np.hypot(slope_x, slope_y)
    if slope < MIN_SLOPE:
        return 0.0, 0.0, np.inf, slope
    away_x = x + field[row, column] * slope_x / slope
    away_y = y + field[row, column] * slope_y / slope
    distance = np.hypot(away_x, away_y)
    if away_x * slope_x + away_y * slope_y <= 0.0 or distance < 1e-9:
        return 0.0, 0.0, np.inf, slope
    return away_x, away_y, distance, slope


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def boundary_samples(
    field: F32, rate: F32, overlap: Mask, corner: F64, cell_m: float, robot: F64, radius_m: float, reach_m: float, bins: int
) -> tuple[F64, F64, F64]:
    """Return the nearest boundary point in each of `bins` directions.

    Source: Cui, Deng, Wang, section 4.3, equation 5 and the text before it.  The clearance and its slope vanish inside an
    obstacle, so both slope and rate are read at the sample cell, outside the boundary, not at the boundary point itself.  The
    rate is the mean over the direction's sample cells whose boundary lies within a cell of the nearest one: a
    distance transform moves in steps of a cell, and the mean of many smooths the steps.

    Args:
        field: clearance [m], shape (rows, columns).
        rate: its rate [m/s], shape (rows, columns).
        overlap: where the rate is known, shape (rows, columns).
        corner: lower corner of the lattice in odom, shape (2,).
        cell_m: size of a cell.
        robot: in odom, shape (2,).
        radius_m: how far from the robot cells are looked at.
        reach_m: largest clearance of a sample cell.
        bins: number of directions.

    Returns:
        Unit normals from boundary to robot in odom, shape (bins, 2); distances [m], shape (bins,), infinite where a
        direction has none; rates at which the boundaries recede [m/s], shape (bins,), negative when they close in.
    """
    rows, columns = field.shape
    normal, distance = np.zeros((bins, 2)), np.full(bins, np.inf)
    centre_row, centre_column = int((robot[1] - corner[1]) / cell_m), int((robot[0] - corner[0]) / cell_m)
    span = int(np.ceil(radius_m / cell_m)) + 1
    found, side = 0, (2 * span + 1) ** 2
    bin_of, distance_of, rate_of = np.empty(side, np.int64), np.empty(side), np.empty(side)
    for row in range(max(1, centre_row - span), min(rows - 1, centre_row + span + 1)):
        for column in range(max(1, centre_column - span), min(columns - 1, centre_column + span + 1)):
            if not 0.0 < field[row, column] <= reach_m:
                continue
            x = robot[0] - corner[0] - (column + 0.5) * cell_m
            y = robot[1] - corner[1] - (row + 0.5) * cell_m
            if x * x + y * y > radius_m * radius_m:
                continue
            away_x, away_y, d, slope = boundary_of(field, row, column, cell_m, x, y)
            if not np.isfinite(d):
                continue
            k = int((np.arctan2(away_y, away_x) / (2.0 * np.pi) + 0.5) * bins) % bins
            if d < distance[k]:
                distance[k], normal[k, 0], normal[k, 1] = d, away_x / d, away_y / d
            if overlap[row, column]:
                bin_of[found], distance_of[found], rate_of[found] = k, d, rate[row, column] / slope
                found += 1
    total, count = np.zeros(bins), np.zeros(bins)
    for i in range(found):
        k = bin_of[i]
        if distance_of[i] <= distance[k] + cell_m:
            total[k] += rate_of[i]
            count[k] += 1.0
    return normal, distance, total / np.maximum(count, 1.0)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def constraints(
    normal: F64, distance: F64, rate: F64, nominal: F64, safe_m: float, alpha: float, guard_m: float, contact_time_s: float,
    reaction_s: float, buffer_gain: float, buffer_min_m: float, buffer_max_m: float,
) -> tuple[F64, F64]:  # fmt: skip
    """Return the half-planes normal . u >= bound that are committed to the QP, shapes (m, 2) and (m,) [m/s].

    Source: Cui, Deng, Wang, equations 6 (constraint), 7 (gate) and 8 (buffer); `rate` is positive when a boundary recedes.

    Args:
        normal: from boundary to robot, shape (n, 2).
        distance: to the boundary [m], shape (n,); infinite ones are left out.
        rate: at which the boundary recedes [m/s], shape (n,).
        nominal: velocity that was asked, shape (2,), in the frame of the normals [m/s].
        safe_m: clearance at which the barrier is zero.
        alpha: gain of the barrier [1/s].
        guard_m: constraints this near are always committed.
        contact_time_s: farther ones are committed when contact is nearer than this.
        reaction_s: for how long a boundary closes in unanswered.
        buffer_gain: beta of equation 8.
        buffer_min_m: least buffer.
        buffer_max_m: largest buffer.
    """
    kept = np.empty(len(distance), np.int64)
    bound = np.empty(len(distance))
    count = 0
    for i in range(len(distance)):
        if not np.isfinite(distance[i]):
            continue
        h = distance[i] - safe_m
        closing = -(rate[i] + normal[i, 0] * nominal[0] + normal[i, 1] * nominal[1])
        if distance[i] > guard_m and h >= contact_time_s * max(0.0, closing):
            continue
        buffer = min(max(buffer_gain * max(0.0, -rate[i]) * reaction_s, buffer_min_m), buffer_max_m)
        kept[count], bound[count] = i, -rate[i] - alpha * (h - buffer)
        count += 1
    return normal[kept[:count]], bound[:count]
