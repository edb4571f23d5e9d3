"""What a depth image says about cells: returns counted, ends of rays collected, the blind zone outlined."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import F64, U8

U16 = NDArray[Any]
I32 = NDArray[Any]


NOTHING = np.int32(np.iinfo(np.int32).min)  # what a pixel's ray that is not to be followed says

Ray = tuple[float, float, float]  # x, y and z in odom, per metre of depth


@kernel()
def _row_is_useless(lowest: float, highest: float, slab: tuple[float, float], range_min: float) -> bool:
    """Tell whether every ray of a row, with rises between the two given, has left the slab before the minimum range."""
    return lowest * range_min > slab[1] or highest * range_min < slab[0]


@kernel(numpy_division=True)
def _end_rays(
    row: U16,  # (width,)
    raw_limits: tuple[int, int],
    depth_unit_m: float,
    first: Ray,
    step: Ray,
    camera: tuple[float, float],
    cells_per_m: float,
    slab: tuple[float, float],
    ranges: tuple[float, float],
    columns: np.int32,
    ends: I32,  # (width,), written
    clear_m: F64,  # (width,), raised to the depth that this row proves empty in each column
) -> None:
    """Write for each pixel of a row the flat index of the cell where its ray hits, its complement where it ends unhindered.

    Without branches and without writes to the grid, so that it vectorises; `_count` does the rest.
    """
    for u in range(len(row)):
        dx, dy, rise = first[0] + step[0] * u, first[1] + step[1] * u, first[2] + step[2] * u
        z = row[u] * depth_unit_m
        leaves = (slab[1] / rise if rise > 0.0 else slab[0] / rise) if rise != 0.0 else math.inf
        reach = min(leaves, ranges[1] / math.sqrt(dx * dx + dy * dy))
        end = min(z, reach)
        index = np.int32(camera[1] + end * dy * cells_per_m) * columns + np.int32(camera[0] + end * dx * cells_per_m)
        useful = (row[u] >= raw_limits[0]) & (row[u] <= raw_limits[1]) & (leaves >= ranges[0])
        ends[u] = (index if z <= reach else ~index) if useful else NOTHING
        clear_m[u] = max(clear_m[u], end if useful else 0.0)


@kernel()
def _count(ends: I32, hits: I32, free_ends: U8) -> None:
    for end in ends:
        if end >= 0:
            hits[end] += 1
        elif end != NOTHING:
            free_ends[~end] = 1


@kernel()
def collect_depth(
    depth: U16,  # (height, width)
    raw_limits: tuple[int, int],  # lowest and highest raw value that is trusted
    depth_unit_m: float,
    pinhole: tuple[float, float, float, float],  # fx, fy, cx, cy
    rotation: F64,  # (3, 3), odom_from_optical
    camera: tuple[float, float],  # x, y in cells from the lattice's corner
    cell_m: float,
    slab: tuple[float, float],  # offsets from the camera's height [m], low <= 0 <= high
    ranges: tuple[float, float],  # minimum depth and maximum planar range [m]
    hits: I32,  # (rows, columns), counted up
    free_ends: U8,  # (rows, columns), set to 1
    clear_m: F64,  # (width,), raised to the depth that is proven empty inside the slab in each image column
) -> None:
    """Count the returns inside the slab per cell, and mark the cells in which the other rays end.

    A ray with a valid depth is known to be empty up to the return.  It counts up to where it hits inside the slab, leaves
    the slab, or reaches the maximum range.  A pixel without a valid depth says nothing; a ray that leaves the slab before
    the minimum range is not worth following.
    """
    fx, fy, cx, cy = pinhole
    last, columns = depth.shape[1] - 1, np.int32(hits.shape[1])
    right, down, ahead = rotation[:, 0] / fx, rotation[:, 1] / fy, rotation[:, 2]
    step = (right[0], right[1], right[2])
    ends = np.empty(depth.shape[1], dtype=np.int32)
    for v in range(depth.shape[0]):
        left = ahead + down * (v - cy) - right * cx
        rise, last_rise = left[2], left[2] + right[2] * last
        if _row_is_useless(min(rise, last_rise), max(rise, last_rise), slab, ranges[0]):
            continue
        first = (left[0], left[1], left[2])
        _end_rays(depth[v], raw_limits, depth_unit_m, first, step, camera, 1.0 / cell_m, slab, ranges, columns, ends, clear_m)
        _count(ends, hits.reshape(-1), free_ends.reshape(-1))


@kernel()
def outline_blind(
    camera: tuple[float, float],  # x, y in cells from the lattice's corner
    forward: tuple[float, float],  # the optical axis in odom, along the floor, unit length
    pinhole: tuple[float, float],  # fx, cx [pixels]
    clear_cells: F64,  # (width,), depth proven empty in each image column
    reach_cells: float,
    blind: NDArray[Any],  # (rows, columns) bool, written
) -> None:
    """Mark the cells in view where an obstacle may be too near to give returns, unless every image column that looks at a
    cell sees past it.
    """
    fx, cx = pinhole
    width = len(clear_cells)
    slope = max(cx + 0.5, width - 0.5 - cx) / fx
    reach = math.ceil(reach_cells * math.sqrt(1.0 + slope**2)) + 1
    row0, column0 = int(camera[1]), int(camera[0])
    for row in range(max(row0 - reach, 0), min(row0 + reach + 1, blind.shape[0])):
        for column in range(max(column0 - reach, 0), min(column0 + reach + 1, blind.shape[1])):
            x, y = column + 0.5 - camera[0], row + 0.5 - camera[1]
            ahead, left = forward[0] * x + forward[1] * y, forward[0] * y - forward[1] * x
            if 0.0 < ahead <= reach_cells and -0.5 <= cx - fx * left / ahead <= width - 0.5:
                blind[row, column] = not _is_seen_past(ahead, left, fx, cx, clear_cells)


@kernel()
def _is_seen_past(ahead: float, left: float, fx: float, cx: float, clear_cells: F64) -> bool:
    half = math.sqrt(0.5)  # of a cell's diagonal
    nearest = max(ahead - half, 0.1)
    first = max(math.floor(cx - fx * (left + half) / nearest), 0)
    last = min(math.ceil(cx - fx * (left - half) / nearest), len(clear_cells) - 1)
    return bool(np.all(clear_cells[first : last + 1] >= ahead + half))
