"""A depth image as a z-buffer: every solid is tested only in the pixels it can cover, so cost goes with covered pixels.

Image rays are (x, y, 1) in the optical frame and not normalised: their parameter t is the depth along the optical axis.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from sim_drivers.ray_kernels import PLANE, first_hit

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

NEAR_M = 1e-4  # a solid that crosses the image plane is cut here before it is projected
_EDGES = np.array([(i, i ^ bit) for i in range(8) for bit in (1, 2, 4)])  # (24, 2): corners of a box, along its edges both ways


@kernel()
def _span(low: float, high: float, count: int) -> tuple[int, int]:
    """Return the half-open range of pixels of an image axis within [low, high], a hair wider."""
    first = np.ceil(min(max(low - 1e-6, 0.0), float(count)))
    last = np.floor(min(max(high + 1e-6, -1.0), count - 1.0))
    return int(first), int(last) + 1


@kernel()
def _transform(rotation: F64, position: F64, centre: F64, local: F64, to_centre: F64, to_local: F64) -> None:
    """Write a pose in the map, `centre` (3,) and `local` (3, 3), as seen from the camera at `position`, `rotation`."""
    for i in range(3):
        to_centre[i] = 0.0
        for k in range(3):
            to_centre[i] += rotation[k, i] * (centre[k] - position[k])
        for j in range(3):
            to_local[i, j] = rotation[0, i] * local[0, j] + rotation[1, i] * local[1, j] + rotation[2, i] * local[2, j]


@kernel()
def _corners(centre: F64, rotation: F64, extents: F64, corners: F64) -> None:
    for i in range(8):
        for axis in range(3):
            corners[i, axis] = centre[axis]
            for k in range(3):
                corners[i, axis] += rotation[axis, k] * (extents[k] if i & (1 << k) else -extents[k])


@kernel()
def _rectangle(corners: F64, pinhole: F64, window: I64) -> float:
    """Project a box, corners (8, 3) in the optical frame, narrow the window (4,) to it and return its least depth."""
    fx, fy, cx, cy = pinhole
    low_u, high_u, low_v, high_v, nearest = np.inf, -np.inf, np.inf, -np.inf, np.inf
    for edge in range(24):  # every edge in both directions: its first end, or where it crosses into what lies ahead
        p, q = _EDGES[edge, 0], _EDGES[edge, 1]
        x, y, z = corners[p, 0], corners[p, 1], corners[p, 2]
        if z < NEAR_M:
            if corners[q, 2] <= NEAR_M:
                continue
            part = (NEAR_M - z) / (corners[q, 2] - z)
            x, y, z = x + part * (corners[q, 0] - x), y + part * (corners[q, 1] - y), NEAR_M
        u, v = fx * x / z + cx, fy * y / z + cy
        low_u, high_u = min(low_u, u), max(high_u, u)
        low_v, high_v = min(low_v, v), max(high_v, v)
        nearest = min(nearest, z)
    window[0], window[1] = _span(low_v, high_v, window[1])
    window[2], window[3] = _span(low_u, high_u, window[3])
    return nearest if nearest > NEAR_M else 0.0


@kernel()
def _draw(
    kind: int, size: F64, centre: F64, rotation: F64, pinhole: F64, window: I64, nearest: float, far: float, depth: F32
) -> None:
    """Keep the nearest depth in the window's pixels; `centre` and `rotation` take local points to the optical frame."""
    fx, fy, cx, cy = pinhole
    c, r = centre, rotation
    o = (
        -(r[0, 0] * c[0] + r[1, 0] * c[1] + r[2, 0] * c[2]),
        -(r[0, 1] * c[0] + r[1, 1] * c[1] + r[2, 1] * c[2]),
        -(r[0, 2] * c[0] + r[1, 2] * c[1] + r[2, 2] * c[2]),
    )
    a = (r[0, 0] / fx, r[0, 1] / fx, r[0, 2] / fx)  # what one pixel to the right adds to the direction
    extent = (size[0], size[1], size[2])
    for v in range(window[0], window[1]):
        y = (v - cy) / fy
        b = (r[1, 0] * y + r[2, 0], r[1, 1] * y + r[2, 1], r[1, 2] * y + r[2, 2])
        for u in range(window[2], window[3]):
            if depth[v, u] <= nearest:
                continue
            x = u - cx
            t = first_hit(kind, extent, o, (a[0] * x + b[0], a[1] * x + b[1], a[2] * x + b[2]))
            if t < depth[v, u] and t <= far:
                depth[v, u] = t


@kernel()
def draw_depth(
    kinds: I64,
    sizes: F64,
    extents: F64,
    centres: F64,
    rotations: F64,
    camera_position: F64,
    camera_rotation: F64,
    pinhole: F64,
    far: float,
    depth: F32,
) -> None:
    """Draw solids into a depth image (height, width) [m], inf where there is nothing within `far`.

    Args:
        kinds: (n,) of the constants above.
        sizes: (n, 3) as in MuJoCo, but radius thrice for a sphere and inf for an endless plane [m].
        extents: (n, 3) half extents of the solid's own bounding box [m].
        centres: (n, 3) in the map [m].
        rotations: (n, 3, 3) map from local.
        camera_position: (3,) in the map [m].
        camera_rotation: (3, 3) map from optical.
        pinhole: (4,) fx, fy, cx, cy [pixels].
        far: greatest depth [m].
        depth: (height, width), written.
    """
    count = len(kinds)
    depth[:] = np.inf
    windows, nearest = np.empty((count, 4), np.int64), np.zeros(count)
    optical_centres, optical_rotations, corners = np.empty((count, 3)), np.empty((count, 3, 3)), np.empty((8, 3))
    for i in range(count):
        centre, rotation = optical_centres[i], optical_rotations[i]
        _transform(camera_rotation, camera_position, centres[i], rotations[i], centre, rotation)
        windows[i, 0], windows[i, 1], windows[i, 2], windows[i, 3] = 0, depth.shape[0], 0, depth.shape[1]
        if kinds[i] != PLANE:
            _corners(centre, rotation, extents[i], corners)
            nearest[i] = _rectangle(corners, pinhole, windows[i])
    for i in np.argsort(nearest):  # front to back: what is hidden is skipped without being intersected
        if nearest[i] > far:
            break
        _draw(kinds[i], sizes[i], optical_centres[i], optical_rotations[i], pinhole, windows[i], nearest[i], far, depth)
