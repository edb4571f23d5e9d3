"""The surface that a range sensor sees, as points of the plane: one per sector of a depth image's columns, or one per beam.

A sector's point is the mean of its returns inside the vertical slab that lie near the sector's median range, so that neither
a flying pixel nor what stands before or behind the surface pulls it.  The slab is that of the depth-to-grid stage.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from drivers.interface.samples import DepthFrame, RangeScan
from estimators.belief import F64
from estimators.grid.depth_grid import SATURATED, DepthGridSettings

RETURNS_MIN = 3  # of a sector, or it says nothing
NEAR_MEDIAN = 0.03  # share of the median range within which a return belongs to the same surface


def points_of_depth(frame: DepthFrame, settings: DepthGridSettings, range_max_m: float, sectors: int) -> F64:
    """Return the points of a sound frame in base, shape (n, 2) [m], from right to left in at most `sectors` sectors."""
    k, pose, unit = frame.intrinsics, frame.base_from_optical, frame.depth_unit_m
    depth = np.ascontiguousarray(frame.depth).view()
    depth.flags.writeable = False  # one compiled kernel serves both kinds of array
    columns = -(-k.width // sectors)
    points = np.empty((-(-k.width // columns), 2))
    count = _collect_sectors(
        depth,
        (max(1, math.ceil(settings.range_min_m / unit)), min(SATURATED - 1, math.floor(settings.depth_max_m / unit))),
        float(unit),
        (float(k.fx), float(k.fy), float(k.cx), float(k.cy)),
        pose.rotation,
        (settings.slab_low_m, settings.slab_high_m),
        (settings.range_min_m, range_max_m),
        columns,
        points,
    )
    return points[:count][::-1] + pose.translation[:2]


def points_of_scan(scan: RangeScan, range_min_m: float, range_max_m: float) -> F64:
    """Return the points of a sound scan in base, shape (n, 2) [m], in the order of its beams, of those that hit something."""
    angle = scan.angle_min_rad + scan.angle_step_rad * np.arange(len(scan.range_m))
    hit = (scan.range_m >= range_min_m) & (scan.range_m <= min(range_max_m, scan.range_max_m))  # a NaN is neither
    reach, angle = scan.range_m[hit], angle[hit]
    return np.stack((reach * np.cos(angle), reach * np.sin(angle)), axis=-1)


@kernel()
def _rows_in_slab(first: float, step: float, slab: tuple[float, float], nearest: float, height: int) -> tuple[int, int]:
    """Return the first row and the one after the last whose rays are still in the slab at the nearest range.

    A row's ray rises by first + step * row per metre of depth.
    """
    if abs(step) < 1e-9:
        return 0, height
    one, other = (slab[0] / nearest - first) / step, (slab[1] / nearest - first) / step
    return max(0, math.floor(max(min(one, other), -1.0))), min(height, math.ceil(min(max(one, other), height)) + 1)


@kernel()
def _collect_sectors(
    depth: NDArray[Any],  # (height, width) uint16
    raw_limits: tuple[int, int],
    depth_unit_m: float,
    pinhole: tuple[float, float, float, float],
    rotation: F64,  # (3, 3), base_from_optical
    slab: tuple[float, float],  # offsets from the camera's height [m]
    ranges: tuple[float, float],  # planar [m]
    columns: int,  # of the image in a sector
    points: F64,  # (sectors, 2), written: from the camera, along the axes of base
) -> int:
    """Write the points from left to right; return how many there are."""
    height, width = depth.shape
    fx, fy, cx, cy = pinhole
    x, y, reach = np.empty(height * columns), np.empty(height * columns), np.empty(height * columns)
    found = 0
    for left in range(0, width, columns):
        count = 0
        for u in range(left, min(left + columns, width)):
            ray = rotation[:, 2] + rotation[:, 0] * ((u - cx) / fx) - rotation[:, 1] * (cy / fy)
            down = rotation[:, 1] / fy
            top, bottom = _rows_in_slab(ray[2], down[2], slab, ranges[0], height)
            for v in range(top, bottom):
                raw = depth[v, u]
                z = raw * depth_unit_m
                rise = (ray[2] + down[2] * v) * z
                if raw < raw_limits[0] or raw > raw_limits[1] or rise < slab[0] or rise > slab[1]:
                    continue
                x[count], y[count] = (ray[0] + down[0] * v) * z, (ray[1] + down[1] * v) * z
                reach[count] = math.sqrt(x[count] ** 2 + y[count] ** 2)
                count += 1
        if count >= RETURNS_MIN and _mean_near_median(x[:count], y[:count], reach[:count], ranges, points[found]):
            found += 1
    return found


@kernel()
def _mean_near_median(x: F64, y: F64, reach: F64, ranges: tuple[float, float], mean: F64) -> bool:
    """Write the mean of the returns near the median range; False: that is out of range."""
    middle = np.median(reach)
    if not ranges[0] <= middle <= ranges[1]:
        return False
    sum_x, sum_y, near = 0.0, 0.0, 0
    for i in range(len(reach)):
        if abs(reach[i] - middle) <= NEAR_MEDIAN * middle:
            sum_x, sum_y, near = sum_x + x[i], sum_y + y[i], near + 1
    if near == 0:  # an even number of returns half of which lie far behind the others
        return False
    mean[0], mean[1] = sum_x / near, sum_y / near
    return True
