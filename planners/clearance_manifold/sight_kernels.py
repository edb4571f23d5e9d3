"""What is in view: a clearance that the edge of the view bounds, and nothing that was seen, is none."""

from __future__ import annotations

import numpy as np

from drivers.interface.geometry import SE2
from drivers.interface.kernel import kernel
from estimators.belief import F64


@kernel()
def in_sight(x: float, y: float, around_m: float, sight: F64) -> bool:
    """Return whether all within `around_m` of a point in odom was in view: who came nearer than that would have been seen.

    Args:
        x: of the point.
        y: of the point.
        around_m: its clearance then.
        sight: what was in view then (`sight_of`), shape (8,).
    """
    off_x, off_y = x - sight[0], y - sight[1]
    away = np.hypot(off_x, off_y)
    if not (sight[6] <= away - around_m and away + around_m <= sight[7]):
        return False
    ahead, aside = sight[2] * off_x + sight[3] * off_y, abs(sight[2] * off_y - sight[3] * off_x)
    inside = sight[5] * ahead - sight[4] * aside  # from the line of its edge
    behind = sight[4] * ahead + sight[5] * aside < 0.0  # the robot, of what it lies nearest to on that line
    return bool(inside >= around_m or (inside > 0.0 and behind) or sight[4] <= -1.0)


def sight_of(pose: SE2, fov_rad: float, near_m: float, far_m: float) -> F64:
    """Return what is in view: place and direction of the robot, direction of the edge from that, and range, shape (8,)."""
    half = 0.5 * fov_rad
    return np.array([pose.x, pose.y, np.cos(pose.yaw), np.sin(pose.yaw), np.cos(half), np.sin(half), near_m, far_m])
