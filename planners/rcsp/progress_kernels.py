"""Progress along the route."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

_NO_LENGTH = 1e-300  # m^2; keeps the share of a segment finite where both its ends are one point


@kernel()
def segments_of(path: F64) -> F64:
    """Return starts (x, y) of a path's segments, their vectors, and the inverses of their squared lengths, shape (5, m - 1)."""
    segments = np.empty((5, max(len(path) - 1, 1)))
    for j in range(segments.shape[1]):
        end = min(j + 1, len(path) - 1)
        ax, ay = path[end, 0] - path[j, 0], path[end, 1] - path[j, 1]
        segments[:, j] = path[j, 0], path[j, 1], ax, ay, 1.0 / max(ax * ax + ay * ay, _NO_LENGTH)
    return segments


@kernel(fast=True)
def nearest_on(segments: F64, x: float, y: float, apart: F64) -> tuple[int, float, float]:
    """Return the segment that is nearest to a point, where on it that is, as a share of it, and the squared distance.

    Args:
        segments: as of `segments_of`, shape (5, n).
        x: of the point.
        y: likewise.
        apart: overwritten, shape (n,); one array written by a loop without branches, which is vectorised.
    """
    start_x, start_y, along_x, along_y, inverse = segments[0], segments[1], segments[2], segments[3], segments[4]
    for j in range(len(apart)):
        t = ((x - start_x[j]) * along_x[j] + (y - start_y[j]) * along_y[j]) * inverse[j]
        t = t if t > 0.0 else 0.0
        t = t if t < 1.0 else 1.0
        dx, dy = x - start_x[j] - t * along_x[j], y - start_y[j] - t * along_y[j]
        apart[j] = dx * dx + dy * dy
    nearest = 0
    for j in range(1, len(apart)):
        if apart[j] < apart[nearest]:
            nearest = j
    t = ((x - start_x[nearest]) * along_x[nearest] + (y - start_y[nearest]) * along_y[nearest]) * inverse[nearest]
    return nearest, min(max(t, 0.0), 1.0), apart[nearest]


@kernel()
def to_go(x: F32, y: F32, yaw: F32, path: F64, along: F64, lateral: float, heading: float, look_ahead_m: float) -> F64:
    """Return the way that is left from each pose, shape (n,) [m]: along the route from the nearest point of it, plus what
    lying beside it and facing away from where it leads cost.

    Args:
        x: of the poses, shape (n,).
        y: likewise.
        yaw: likewise.
        path: the route, shape (m, 2).
        along: distance of its points along it, shape (m,).
        lateral: metres per metre beside it.
        heading: metres per radian that the pose faces away from the point `look_ahead_m` farther along.
        look_ahead_m: at the route's end the heading counts no more.
    """
    left, segments, last = np.empty(len(x)), segments_of(path), len(path) - 1
    apart = np.empty(segments.shape[1])
    for i in range(len(x)):
        j, share, squared = nearest_on(segments, x[i], y[i], apart)
        at = along[j] + share * (along[min(j + 1, last)] - along[j])
        wanted = min(at + look_ahead_m, along[last])
        while j < last and along[j] < wanted:
            j += 1
        bearing = np.arctan2(path[j, 1] - y[i], path[j, 0] - x[i]) - yaw[i]
        off = abs((bearing + np.pi) % (2.0 * np.pi) - np.pi)
        near_end = min(1.0, (along[last] - at) / look_ahead_m)
        left[i] = along[last] - at + lateral * np.sqrt(squared) + heading * near_end * off
    return left


@kernel()
def way_made(
    pose: F64, x: F32, y: F32, yaw: F32, looks: NDArray[np.int64], path: F64, along: F64, lateral: float, heading: float,
    look_ahead_m: float,
) -> F64:  # fmt: skip
    """Return how much of the way to go each motion makes at the best of some steps, shape (commands,) [m].

    Args:
        pose: x, y, yaw now, shape (3,).
        x: of the motions, shape (commands, steps).
        y: likewise.
        yaw: likewise.
        looks: the steps.
        path: as of `to_go`, and what follows.
        along: likewise.
        lateral: likewise.
        heading: likewise.
        look_ahead_m: likewise.
    """
    commands = len(x)
    poses = np.empty((3, len(looks) * commands + 1), np.float32)  # the present one last
    for k in range(len(looks)):
        for u in range(commands):
            at = k * commands + u
            poses[0, at], poses[1, at], poses[2, at] = x[u, looks[k]], y[u, looks[k]], yaw[u, looks[k]]
    poses[:, -1] = pose
    left = to_go(poses[0], poses[1], poses[2], path, along, lateral, heading, look_ahead_m)
    made = np.full(commands, -np.inf)
    for at in range(len(left) - 1):
        made[at % commands] = max(made[at % commands], left[-1] - left[at])
    return made
