"""Arc length along a path, and the point to aim at on it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F64 = NDArray[np.float64]


def arc_length(path: F64) -> F64:
    """Return the distance along the path of every point of it, shape (n,) [m].

    >>> arc_length(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 5.0]])).tolist()
    [0.0, 5.0, 6.0]
    """
    steps = np.hypot(*np.diff(path, axis=0).T)
    return np.concatenate(([0.0], np.cumsum(steps)))


def resample(path: F64, spacing_m: float) -> F64:
    """Return the path with points about `spacing_m` apart, its two ends kept, shape (m, 2) with m >= 2.

    >>> resample(np.array([[0.0, 0.0], [1.0, 0.0]]), 0.5).tolist()
    [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]
    """
    along = arc_length(path)
    count = max(2, 1 + round(float(along[-1]) / spacing_m))
    wanted = np.linspace(0.0, along[-1], count)
    return np.stack((np.interp(wanted, along, path[:, 0]), np.interp(wanted, along, path[:, 1])), axis=1)


@kernel()
def beginning(path: F64, length_m: float, spacing_m: float) -> tuple[F64, F64]:
    """Return the first `length_m` of the path with points at least `spacing_m` apart, and the distance along it of each.

    Both ends are kept, so that there are at least two points: shapes (m, 2) and (m,).
    """
    kept, along = np.empty((len(path) + 1, 2)), np.empty(len(path) + 1)
    kept[0], along[0] = path[0], 0.0
    count, travelled = 1, 0.0
    for i in range(1, len(path)):
        travelled += np.hypot(path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1])
        last = i == len(path) - 1 or travelled >= length_m
        if last or travelled - along[count - 1] >= spacing_m:
            kept[count], along[count] = path[i], travelled
            count += 1
        if last:
            break
    if count == 1:
        kept[1], along[1] = path[0], 0.0
        count = 2
    return kept[:count], along[:count]


@kernel()
def point_along(path: F64, distance_m: float) -> tuple[float, float]:
    """Return the point of the path, shape (n, 2), that lies `distance_m` along it; its end when it is shorter."""
    left = distance_m
    for i in range(len(path) - 1):
        dx, dy = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
        step = np.hypot(dx, dy)
        if step >= left and step > 0.0:
            return path[i, 0] + dx * left / step, path[i, 1] + dy * left / step
        left -= step
    return path[-1, 0], path[-1, 1]
