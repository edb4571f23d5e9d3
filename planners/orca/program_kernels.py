"""The velocity nearest to the preferred one in an intersection of half-planes, and the least bad one where that is empty.

Source: van den Berg, Guy, Lin, Manocha, Reciprocal n-body collision avoidance, sections 5.1 and 5.3; the incremental linear
program is that of de Berg et al., Computational Geometry, section 4.4.  A half-plane holds the v with normal . v >= bound.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F64 = NDArray[np.float64]

_PARALLEL = 1e-9
_TOLERANCE = 1e-9  # m/s
_FAR = 1e4  # m/s: the nearest point to one so far away is the extreme one in its direction


@kernel()
def nearest_on_edge(normals: F64, bounds: F64, edge: int, wanted: F64) -> tuple[bool, float, float]:
    """Return whether the edge of a half-plane meets all earlier ones, and its point in them nearest to the wanted one."""
    nx, ny = normals[edge, 0], normals[edge, 1]
    x, y = nx * bounds[edge], ny * bounds[edge]  # the edge's point nearest to zero; along it runs (-ny, nx)
    low, high = -np.inf, np.inf
    for j in range(edge):
        slope = normals[j, 1] * nx - normals[j, 0] * ny
        missing = bounds[j] - normals[j, 0] * x - normals[j, 1] * y
        if abs(slope) < _PARALLEL:
            if missing > _TOLERANCE:
                return False, 0.0, 0.0
        elif slope > 0.0:
            low = max(low, missing / slope)
        else:
            high = min(high, missing / slope)
    if low > high:
        return False, 0.0, 0.0
    at = min(max((wanted[1] - y) * nx - (wanted[0] - x) * ny, low), high)
    return True, x - ny * at, y + nx * at


@kernel()
def nearest_inside(normals: F64, bounds: F64, wanted: F64) -> tuple[int, F64]:
    """Return the point, shape (2,), of the intersection of n half-planes nearest to the wanted one, shape (2,).

    The first integer is n, or else the index of the half-plane that leaves nothing of those before it; the point is then the
    nearest one in these.
    """
    best = wanted.copy()
    for i in range(len(bounds)):
        if normals[i, 0] * best[0] + normals[i, 1] * best[1] >= bounds[i] - _TOLERANCE:
            continue
        found, x, y = nearest_on_edge(normals, bounds, i, wanted)
        if not found:
            return i, best
        best[0], best[1] = x, y
    return len(bounds), best


@kernel()
def least_violation(normals: F64, bounds: F64, hard: int, start: F64) -> tuple[F64, float]:
    """Return the point, shape (2,), that violates the worst soft half-plane least, and by how much [m/s].

    The third dimension is the violation that all soft half-planes are granted: one by one, whichever is worse than granted
    becomes the worst, and the point is sought that violates it least while no earlier one becomes worse than it.

    Args:
        normals: shape (n, 2).
        bounds: shape (n,).
        hard: so many, the first ones, are kept; together they are bounded and hold a point.
        start: the point to begin with, in all hard half-planes, shape (2,).
    """
    best, granted = start.copy(), 0.0
    planes, limits = np.empty_like(normals), np.empty_like(bounds)
    planes[:hard], limits[:hard] = normals[:hard], bounds[:hard]
    for i in range(hard, len(bounds)):
        if bounds[i] - normals[i] @ best <= granted + _TOLERANCE:
            continue
        count = hard
        for j in range(hard, i):  # where half-plane j is violated no more than i
            x, y = normals[j, 0] - normals[i, 0], normals[j, 1] - normals[i, 1]
            length = np.hypot(x, y)
            if length > _PARALLEL:
                planes[count, 0], planes[count, 1] = x / length, y / length
                limits[count] = (bounds[j] - bounds[i]) / length
                count += 1
        met, point = nearest_inside(planes[:count], limits[:count], best + _FAR * normals[i])
        if met == count:
            best = point
        granted = max(bounds[i] - normals[i] @ best, 0.0)
    return best, granted


@kernel()
def choose_velocity(normals: F64, bounds: F64, hard: int, wanted: F64) -> tuple[F64, float]:
    """Return the permitted velocity nearest to the wanted one, shape (2,), and the violation that had to be granted [m/s].

    The first `hard` half-planes are always kept; they are bounded and hold a point.
    """
    met, best = nearest_inside(normals, bounds, wanted)
    if met == len(bounds):
        return best, 0.0
    _, start = nearest_inside(normals[:hard], bounds[:hard], wanted)
    best, granted = least_violation(normals, bounds, hard, start)
    return best, granted
