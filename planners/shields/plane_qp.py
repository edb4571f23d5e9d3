"""The exact quadratic program of a planar velocity filter: the point of a box and some half-planes nearest to the one asked.

The feasible set is a convex polygon: the box, cut by one half-plane after another (Sutherland and Hodgman, 1974).  The
optimum is the point asked if it lies inside, else the nearest point of the polygon's edges; no iteration, no tolerance to
tune, and a box without width (a base that cannot strafe) is a polygon like any other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F64 = NDArray[np.float64]

SLACK_RESOLUTION = 1e-6  # m/s


@kernel()
def cut(polygon: F64, normal: F64, bound: float) -> F64:
    """Return the part of a convex polygon, corners in order, shape (n, 2), with normal . u >= bound, shape (m, 2); m may be 0."""
    n = len(polygon)
    kept = np.empty((2 * n + 2, 2))
    count = 0
    x, y = polygon[n - 1, 0], polygon[n - 1, 1]
    over = normal[0] * x + normal[1] * y - bound
    for i in range(n):  # the edge from (x, y) to corner i
        after_x, after_y = polygon[i, 0], polygon[i, 1]
        over_after = normal[0] * after_x + normal[1] * after_y - bound
        if over * over_after < 0.0:
            part = over / (over - over_after)
            kept[count, 0], kept[count, 1] = x + (after_x - x) * part, y + (after_y - y) * part
            count += 1
        if over_after >= 0.0:
            kept[count, 0], kept[count, 1] = after_x, after_y
            count += 1
        x, y, over = after_x, after_y, over_after
    return kept[:count]


@kernel()
def feasible_polygon(normals: F64, bounds: F64, slack: float, low: F64, high: F64) -> F64:
    """Return the corners, shape (m, 2), of the box cut by normals . u >= bounds - slack; empty when nothing is left."""
    polygon = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    for i in range(len(bounds)):
        polygon = cut(polygon, normals[i], bounds[i] - slack)
        if len(polygon) == 0:
            break
    return polygon


@kernel()
def worst_violation(normals: F64, bounds: F64, u: F64) -> float:
    """Return by how much the worst of normals . u >= bounds fails at u; negative when all hold, -inf when there is none."""
    worst = -np.inf
    for i in range(len(bounds)):
        worst = max(worst, bounds[i] - normals[i, 0] * u[0] - normals[i, 1] * u[1])
    return worst


@kernel()
def nearest_in_polygon(polygon: F64, u: F64) -> F64:
    """Return the point of the polygon's edges, corners in order, shape (n, 2) with n > 0, that is nearest to u, shape (2,)."""
    best = np.inf
    nearest: F64 = polygon[0].copy()
    n = len(polygon)
    for i in range(n):
        start, along = polygon[i], polygon[(i + 1) % n] - polygon[i]
        length2 = along[0] * along[0] + along[1] * along[1]
        part = 0.0
        if length2 > 0.0:
            part = min(max(((u[0] - start[0]) * along[0] + (u[1] - start[1]) * along[1]) / length2, 0.0), 1.0)
        point = start + part * along
        apart = (point[0] - u[0]) ** 2 + (point[1] - u[1]) ** 2
        if apart < best:
            best, nearest = apart, point
    return nearest


@kernel()
def solve(normals: F64, bounds: F64, asked: F64, low: F64, high: F64) -> tuple[F64, float]:
    """Minimise |u - asked|^2 subject to low <= u <= high and normals . u >= bounds.

    Where no u satisfies all, the half-planes are relaxed by one common slack, the smallest for which the box still holds a
    point (found by bisection to SLACK_RESOLUTION), so that the largest violation is least; the box is never left.

    Args:
        normals: unit normals of the half-planes, shape (m, 2).
        bounds: shape (m,) [m/s].
        asked: shape (2,) [m/s].
        low: lower corner of the box, shape (2,) [m/s].
        high: upper corner, shape (2,) [m/s].

    Returns:
        u, shape (2,) [m/s], and the slack [m/s], 0 when all half-planes hold.
    """
    clipped = np.minimum(np.maximum(asked, low), high)
    if worst_violation(normals, bounds, clipped) <= 0.0:
        return clipped, 0.0
    polygon = feasible_polygon(normals, bounds, 0.0, low, high)
    if len(polygon) > 0:
        return np.minimum(np.maximum(nearest_in_polygon(polygon, asked), low), high), 0.0
    too_little, enough = 0.0, worst_violation(normals, bounds, clipped)
    polygon = clipped.reshape(1, 2)  # what is known to be feasible with the slack `enough`
    while enough - too_little > SLACK_RESOLUTION:
        middle = 0.5 * (too_little + enough)
        relaxed = feasible_polygon(normals, bounds, middle, low, high)
        if len(relaxed) > 0:
            enough, polygon = middle, relaxed
        else:
            too_little = middle
    return np.minimum(np.maximum(nearest_in_polygon(polygon, asked), low), high), enough
