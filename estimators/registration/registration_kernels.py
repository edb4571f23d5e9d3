"""Points against reference lines: which lies on which, and the normal equations of their distances."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import F64

NO_LINE = -1
CAUCHY = 2.385  # of the standard deviation: 95 % efficient where errors are normal (Zhang, Parameter estimation, 1997)


@kernel()
def _is_beside(x: float, y: float, ends: F64, beyond_m: float) -> bool:
    """Tell whether a point's foot lies between a line's ends, shape (4,), or at most so far beyond."""
    dx, dy = ends[2] - ends[0], ends[3] - ends[1]
    length = math.sqrt(dx * dx + dy * dy)
    along = ((x - ends[0]) * dx + (y - ends[1]) * dy) / length
    return bool(-beyond_m <= along <= length + beyond_m)


@kernel()
def _variance(jacobian: F64, covariance: F64) -> float:
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += jacobian[i] * covariance[i, j] * jacobian[j]
    return total


@kernel()
def match_points(
    points: F64,  # (n, 2) in base
    piece: NDArray[Any],  # (n,) int64; points of no piece (negative) match nothing
    direction: F64,  # (pieces, 2) in base
    pose: F64,  # (3,), x, y [m], yaw [rad] of base in map
    covariance: F64,  # (3, 3) of the pose: widens the gate by three standard deviations; zero later on
    gates: tuple[float, float, float, float],  # distance [m], at most [m], beyond the ends [m], cosine of the angle
    normal: F64,  # (lines, 2) in map, unit length
    offset: F64,  # (lines,): normal . point = offset
    ends: F64,  # (lines, 4): x, y of one end, x, y of the other
    line: NDArray[Any],  # (n,) int64, written: on which line each point lies, or NO_LINE
) -> None:
    """Give each point the nearest line in its gate that runs as the surface does there."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    jacobian = np.empty(3)
    for i in range(len(points)):
        line[i] = NO_LINE
        if piece[i] < 0:
            continue
        px, py = c * points[i, 0] - s * points[i, 1], s * points[i, 0] + c * points[i, 1]
        dx, dy = direction[piece[i], 0], direction[piece[i], 1]
        along_x, along_y = c * dx - s * dy, s * dx + c * dy
        nearest = math.inf
        for k in range(len(offset)):
            nx, ny = normal[k, 0], normal[k, 1]
            if abs(nx * along_y - ny * along_x) < gates[3]:
                continue
            distance = abs(nx * (pose[0] + px) + ny * (pose[1] + py) - offset[k])
            if distance >= min(nearest, gates[1]):
                continue
            jacobian[0], jacobian[1], jacobian[2] = nx, ny, ny * px - nx * py
            gate = gates[0] + 3.0 * math.sqrt(max(_variance(jacobian, covariance), 0.0))
            if distance < gate and _is_beside(pose[0] + px, pose[1] + py, ends[k], gates[2]):
                nearest, line[i] = distance, k


@kernel()
def normal_equations(
    points: F64,  # (n, 2) in base
    noise_m: F64,  # (n,), standard deviation of each
    line: NDArray[Any],  # (n,) int64
    pose: F64,  # (3,)
    normal: F64,  # (lines, 2)
    offset: F64,  # (lines,)
    usable: NDArray[Any],  # (lines,) bool: whether a line may move the pose
    information: F64,  # (3, 3), written
    pull: F64,  # (3,), written: minus the gradient
    geometry: F64,  # (3, 3), written: mean outer product of the unweighted derivatives; its trace is at least 1
) -> tuple[int, float, float]:
    """Sum what the points on usable lines say of a small motion (x, y [m] along map, yaw [rad] about base).

    Errors count by Cauchy's weights.  Returns the number of points, the sum of the weights over variances, and the sum of
    the weighted squared errors.
    """
    information[:], pull[:], geometry[:] = 0.0, 0.0, 0.0
    c, s = math.cos(pose[2]), math.sin(pose[2])
    count, sum_robust, sum_weight, sum_square = 0, 0.0, 0.0, 0.0
    jacobian = np.empty(3)
    for i in range(len(points)):
        k = line[i]
        if k < 0 or not usable[k]:
            continue
        px, py = c * points[i, 0] - s * points[i, 1], s * points[i, 0] + c * points[i, 1]
        nx, ny = normal[k, 0], normal[k, 1]
        jacobian[0], jacobian[1], jacobian[2] = nx, ny, ny * px - nx * py
        error = nx * (pose[0] + px) + ny * (pose[1] + py) - offset[k]
        robust = 1.0 / (1.0 + (error / (CAUCHY * noise_m[i])) ** 2)
        weight = robust / noise_m[i] ** 2
        for a in range(3):
            pull[a] -= weight * error * jacobian[a]
            for b in range(3):
                information[a, b] += weight * jacobian[a] * jacobian[b]
                geometry[a, b] += robust * jacobian[a] * jacobian[b]
        count, sum_robust = count + 1, sum_robust + robust
        sum_weight, sum_square = sum_weight + weight, sum_square + weight * error**2
    if sum_robust > 0.0:
        geometry /= sum_robust
    return count, sum_weight, sum_square
