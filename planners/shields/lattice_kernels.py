"""Short rollouts of many twists past what stands still and what moves on as tracked.

Source: Han, Zhu, RCSP, section 4.4.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from estimators.field_query import bilinear

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]


class Local(NamedTuple):
    """What is around the robot now; odom frame."""

    clearance: F32  # (rows, columns), to what stands still
    corner_x: float
    corner_y: float
    cell_m: float
    movers: F64  # (n, 5): x, y, vx, vy, distance of the centres at contact
    radius_m: float
    far_m: float  # clearance beyond which more is worth nothing


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def clearance_at(local: Local, x: float, y: float, time_s: float) -> float:
    """Return the clearance at a place and time, surface to surface [m]; negative where they overlap."""
    least = bilinear(local.clearance, local.corner_x, local.corner_y, local.cell_m, x, y) - local.radius_m
    for i in range(len(local.movers)):
        o = local.movers[i]
        least = min(least, np.hypot(o[0] + time_s * o[2] - x, o[1] + time_s * o[3] - y) - o[4])
    capped: float = min(least, local.far_m)
    return capped


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def forecast(
    pose: F64, now: F64, twists: F64, acceleration: F64, latency_s: float, response_s: float, step_s: float, steps: int,
    local: Local,
) -> tuple[F64, F64, float]:  # fmt: skip
    """Drive every twist from the present motion; return least clearance, shape (n,), end, shape (n, 2), and clearance now.

    Args:
        pose: x, y, yaw in odom, shape (3,).
        now: vx, vy, wz driven now, shape (3,).
        twists: asked, shape (n, 3).
        acceleration: with which they are approached, shape (3,).
        latency_s: the present motion goes on for so long.
        response_s: time constant of the approach.
        step_s: of the rollout.
        steps: likewise.
        local: surroundings.
    """
    share = 1.0 - np.exp(-step_s / response_s) if response_s > 0.0 else 1.0
    least, end = np.empty(len(twists)), np.empty((len(twists), 2))
    here = clearance_at(local, pose[0], pose[1], 0.0)
    velocity = np.empty(3)
    for i in range(len(twists)):
        x, y, yaw, time_s = pose[0], pose[1], pose[2], 0.0
        velocity[:] = now
        least[i] = np.inf
        for k in range(steps + 1):
            dt = latency_s if k == 0 else step_s
            if k > 0:
                for axis in range(3):
                    most = acceleration[axis] * dt
                    velocity[axis] += min(max((twists[i, axis] - velocity[axis]) * share, -most), most)
            heading = yaw + 0.5 * velocity[2] * dt
            c, s = np.cos(heading), np.sin(heading)
            x += (c * velocity[0] - s * velocity[1]) * dt
            y += (s * velocity[0] + c * velocity[1]) * dt
            yaw += velocity[2] * dt
            time_s += dt
            least[i] = min(least[i], clearance_at(local, x, y, time_s))
        end[i, 0], end[i, 1] = x, y
    return least, end, here
