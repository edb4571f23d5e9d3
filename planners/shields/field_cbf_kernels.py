"""Boundary samples and constraints of the field-CBF, read from the clearance field; arrays in, arrays out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from planners.shields.plane_qp import solve

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
I64 = NDArray[np.int64]
Mask = NDArray[np.bool_]

ALWAYS, FIELD_RATE, MATERIAL = 0, 1, 2  # what opens the gate of a boundary beyond the guard zone

MIN_SLOPE = (
    0.9  # a distance field rises by 1 per metre; where less is left, two boundaries cancel (medial axis), and none lies there
)


class Barrier(NamedTuple):
    """How much room is kept, and when; the shield's settings in the paper's units."""

    safe_m: float  # clearance at which the barrier is zero
    directions: int
    sample_radius_m: float
    alpha_per_s: float
    guard_m: float  # boundaries this near always constrain
    contact_time_s: float  # farther ones when contact is nearer than this
    reaction_s: float  # for how long a boundary closes in unanswered
    buffer_gain: float
    buffer_min_m: float
    buffer_max_m: float
    gate: int


@kernel()
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
    slope = np.sqrt(slope_x * slope_x + slope_y * slope_y)
    if slope < MIN_SLOPE:
        return 0.0, 0.0, np.inf, slope
    away_x = x + field[row, column] * slope_x / slope
    away_y = y + field[row, column] * slope_y / slope
    distance = np.sqrt(away_x * away_x + away_y * away_y)
    if away_x * slope_x + away_y * slope_y <= 0.0 or distance < 1e-9:
        return 0.0, 0.0, np.inf, slope
    return away_x, away_y, distance, slope


@kernel()
def direction_bin(x: float, y: float, bins: int) -> int:
    """Return in which of `bins` directions a vector points, counted on a diamond instead of a circle: no arc tangent."""
    along = x / (abs(x) + abs(y))
    turn = 1.0 - along if y >= 0.0 else 3.0 + along  # 0 to 4
    return int(turn * 0.25 * bins) % bins


@kernel()
def boundary_samples(
    field: F32, rate: F32, overlap: Mask, corner: F64, cell_m: float, robot: F64, radius_m: float, reach_m: float, bins: int
) -> tuple[F64, F64, F64, bool]:
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
        direction has none; rates at which the boundaries recede [m/s], shape (bins,), negative when they close in; and
        whether the robot's own cell is occupied.
    """
    rows, columns = field.shape
    normal, distance = np.zeros((bins, 2)), np.full(bins, np.inf)
    centre_row, centre_column = int(np.floor((robot[1] - corner[1]) / cell_m)), int(np.floor((robot[0] - corner[0]) / cell_m))
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
            k = direction_bin(away_x, away_y, bins)
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
    inside = 0 <= centre_row < rows and 0 <= centre_column < columns
    enclosed = inside and field[centre_row, centre_column] <= 0.0
    return normal, distance, total / np.maximum(count, 1.0), enclosed


@kernel()
def own_gradient(field: F32, rate: F32, overlap: Mask, corner: F64, cell_m: float, robot: F64) -> tuple[F64, F64, F64, bool]:
    """Return what a single-scalar barrier h = Gamma(x) - Gamma_safe reads at the robot, in the form of `boundary_samples`.

    Source: Cui, Deng, Wang, section 4.3.  The normal is the field's slope as it is: between two walls it cancels.

    Args:
        field: clearance [m], shape (rows, columns).
        rate: its rate [m/s], shape (rows, columns).
        overlap: where the rate is known, shape (rows, columns).
        corner: lower corner of the lattice in odom, shape (2,).
        cell_m: size of a cell.
        robot: in odom, shape (2,).
    """
    rows, columns = field.shape
    normal, distance, recede = np.zeros((1, 2)), np.full(1, np.inf), np.zeros(1)
    row, column = int(np.floor((robot[1] - corner[1]) / cell_m)), int(np.floor((robot[0] - corner[0]) / cell_m))
    if not (0 < row < rows - 1 and 0 < column < columns - 1):
        return normal, distance, recede, False
    slope_x = (field[row, column + 1] - field[row, column - 1]) / (2.0 * cell_m)
    slope_y = (field[row + 1, column] - field[row - 1, column]) / (2.0 * cell_m)
    off_x = robot[0] - corner[0] - (column + 0.5) * cell_m
    off_y = robot[1] - corner[1] - (row + 0.5) * cell_m
    normal[0, 0], normal[0, 1] = slope_x, slope_y
    distance[0] = field[row, column] + slope_x * off_x + slope_y * off_y
    recede[0] = rate[row, column] if overlap[row, column] else 0.0
    return normal, distance, recede, field[row, column] <= 0.0


@kernel()
def constraints(normal: F64, distance: F64, rate: F64, asked: F64, barrier: Barrier) -> tuple[F64, F64, I64]:
    """Return the half-planes normal . u >= bound that are committed to the QP, (m, 2) and (m,) [m/s], and of which samples, (m,).

    Source: Cui, Deng, Wang, equations 6 (constraint), 7 (gate) and 8 (buffer).

    Args:
        normal: from boundary to robot, shape (n, 2).
        distance: to the boundary [m], shape (n,); infinite ones are left out.
        rate: at which the boundary recedes [m/s], shape (n,).
        asked: velocity, shape (2,), in the frame of the normals [m/s].
        barrier: how much room is kept, and when.
    """
    kept = np.empty(len(distance), np.int64)
    bound = np.empty(len(distance))
    count = 0
    for i in range(len(distance)):
        if not np.isfinite(distance[i]):
            continue
        h = distance[i] - barrier.safe_m
        closing = -rate[i]
        if barrier.gate == MATERIAL:
            closing -= normal[i, 0] * asked[0] + normal[i, 1] * asked[1]
        near = distance[i] <= barrier.guard_m or h < barrier.contact_time_s * max(0.0, closing)
        if barrier.gate != ALWAYS and not near:
            continue
        wanted = barrier.buffer_gain * max(0.0, -rate[i]) * barrier.reaction_s
        buffer = min(max(wanted, barrier.buffer_min_m), barrier.buffer_max_m)
        kept[count], bound[count] = i, -rate[i] - barrier.alpha_per_s * (h - buffer)
        count += 1
    return normal[kept[:count]], bound[:count], kept[:count]


@kernel()
def filter_velocity(
    normal: F64, distance: F64, rate: F64, enclosed: bool, pose: F64, asked: F64, low: F64, high: F64, barrier: Barrier
) -> tuple[float, float, F64, F64, float, float, bool]:
    """Constrain and solve, in the body frame.

    Args:
        normal: from boundary to robot in odom, shape (n, 2).
        distance: to the boundary [m], shape (n,); infinite where there is none.
        rate: at which the boundary recedes [m/s], shape (n,).
        enclosed: whether the robot's own cell is occupied; then the velocity is zero.
        pose: x, y, yaw in odom, shape (3,).
        asked: vx, vy in the body frame, shape (2,).
        low: least vx, vy that can be reached, shape (2,).
        high: largest vx, vy that can be reached, shape (2,).
        barrier: how much room is kept, and when.

    Returns:
        vx, vy; the boundary points in odom, shape (k, 2), and those of them that constrain, shape (m, 2); the least distance [m],
        infinite without samples; the slack of the QP [m/s]; and `enclosed`.
    """
    c, s = np.cos(pose[2]), np.sin(pose[2])
    in_body, points = np.empty_like(normal), np.empty_like(normal)
    count, nearest = 0, np.inf
    for i in range(len(distance)):
        in_body[i, 0] = c * normal[i, 0] + s * normal[i, 1]
        in_body[i, 1] = c * normal[i, 1] - s * normal[i, 0]
        if np.isfinite(distance[i]):
            points[count] = pose[:2] - distance[i] * normal[i]
            nearest = min(nearest, distance[i])
            count += 1
    if enclosed:
        return 0.0, 0.0, points[:count], points[:0], nearest, 0.0, True
    normals, bounds, kept = constraints(in_body, distance, rate, asked, barrier)
    u, slack = solve(normals, bounds, asked, low, high)
    constraining = np.empty((len(kept), 2))
    for i in range(len(kept)):
        constraining[i] = pose[:2] - distance[kept[i]] * normal[kept[i]]
    return u[0], u[1], points[:count], constraining, nearest, slack, False
