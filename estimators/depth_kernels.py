"""What a depth image says about cells: returns counted, ends of rays collected, the blind zone outlined."""

from __future__ import annotations

import math
from typing import Any

from numba import njit
from numpy.typing import NDArray

from estimators.belief import F64, U8
from estimators.label_kernels import FREE_END, HIT_END

U16 = NDArray[Any]
I32 = NDArray[Any]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _row_is_useless(lowest: float, highest: float, slab_low: float, slab_high: float, range_min: float) -> bool:
    """Tell whether every ray of a row, with rises between the two given, has left the slab before the minimum range."""
    return lowest * range_min > slab_high or highest * range_min < slab_low


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
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
    ends: U8,  # (rows, columns), FREE_END and HIT_END are set
) -> None:
    """Count the returns inside the slab per cell and mark the cell in which each ray ends.

    A ray with a valid depth is known to be empty up to the return.  It counts up to where it hits inside the slab, leaves
    the slab, or reaches the maximum range.  A pixel without a valid depth says nothing; a ray that leaves the slab before
    the minimum range is not worth following.
    """
    fx, fy, cx, cy = pinhole
    slab_low, slab_high = slab
    range_min, range_max = ranges
    r00, r10, r20 = rotation[0, 0] / fx, rotation[1, 0] / fx, rotation[2, 0] / fx
    last = depth.shape[1] - 1
    for v in range(depth.shape[0]):
        b = (v - cy) / fy
        x0 = rotation[0, 1] * b + rotation[0, 2] - r00 * cx
        y0 = rotation[1, 1] * b + rotation[1, 2] - r10 * cx
        z0 = rotation[2, 1] * b + rotation[2, 2] - r20 * cx
        if _row_is_useless(min(z0, z0 + r20 * last), max(z0, z0 + r20 * last), slab_low, slab_high, range_min):
            continue
        for u in range(last + 1):
            raw = depth[v, u]
            if raw < raw_limits[0] or raw > raw_limits[1]:
                continue
            dx, dy, rise = x0 + r00 * u, y0 + r10 * u, z0 + r20 * u  # of the ray, per metre of depth
            z = raw * depth_unit_m
            height, planar_squared = z * rise, dx * dx + dy * dy
            hit = slab_low <= height <= slab_high and z * z * planar_squared <= range_max * range_max
            if not hit:
                leaves = (slab_high if rise > 0.0 else slab_low) / rise if rise != 0.0 else math.inf
                if leaves < range_min:
                    continue
                z = min(leaves, range_max / math.sqrt(planar_squared))
            column, row = int(camera[0] + z * dx / cell_m), int(camera[1] + z * dy / cell_m)
            if hit:
                hits[row, column] += 1
            ends[row, column] |= HIT_END if hit else FREE_END


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def outline_blind(
    camera: tuple[float, float],  # x, y in cells from the lattice's corner
    forward: tuple[float, float],  # the optical axis in odom, along the floor, unit length
    slopes: tuple[float, float],  # tangents of the view's edges, right and left of the axis
    reach_cells: float,
    blind: NDArray[Any],  # (rows, columns) bool, set where the camera looks but is too near to see
) -> None:
    """Mark the cells in view that are nearer than the camera can measure."""
    reach = math.ceil(reach_cells * math.sqrt(1.0 + max(slopes[0], slopes[1]) ** 2)) + 1
    row0, column0 = int(camera[1]), int(camera[0])
    for row in range(max(row0 - reach, 0), min(row0 + reach + 1, blind.shape[0])):
        for column in range(max(column0 - reach, 0), min(column0 + reach + 1, blind.shape[1])):
            x, y = column + 0.5 - camera[0], row + 0.5 - camera[1]
            ahead, left = forward[0] * x + forward[1] * y, forward[0] * y - forward[1] * x
            blind[row, column] = 0.0 < ahead <= reach_cells and -slopes[0] * ahead <= left <= slopes[1] * ahead
