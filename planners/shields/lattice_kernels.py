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
        dx, dy = o[0] + time_s * o[2] - x, o[1] + time_s * o[3] - y
        least = min(least, np.sqrt(dx * dx + dy * dy) - o[4])
    capped: float = min(least, local.far_m)
    return capped


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def courses(
    yaw: float, now: float, turns: F64, acceleration: float, latency_s: float, response_s: float, step_s: float, steps: int
) -> tuple[F64, NDArray[np.int64]]:
    """Return cosine and sine of the heading in the middle of each step, shape (n, steps + 1, 2), and the row of each turn, (n,).

    They follow from the turn alone, and twists of a lattice share theirs: those of a turn that comes again stand in the row of
    the first.  The arguments are those of `forecast`.
    """
    share = 1.0 - np.exp(-step_s / response_s) if response_s > 0.0 else 1.0
    course, row = np.empty((len(turns), steps + 1, 2)), np.empty(len(turns), np.int64)
    for i in range(len(turns)):
        row[i] = 0
        while row[i] < i and turns[row[i]] != turns[i]:
            row[i] += 1
        if row[i] < i:
            continue
        angle, turn = yaw, now
        for k in range(steps + 1):
            dt = latency_s if k == 0 else step_s
            if k > 0:
                most = acceleration * dt
                turn += min(max((turns[i] - turn) * share, -most), most)
            heading = angle + 0.5 * turn * dt
            course[i, k, 0], course[i, k, 1] = np.cos(heading), np.sin(heading)
            angle += turn * dt
    return course, row


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
    course, like = courses(pose[2], now[2], twists[:, 2].copy(), acceleration[2], latency_s, response_s, step_s, steps)
    share = 1.0 - np.exp(-step_s / response_s) if response_s > 0.0 else 1.0
    least, end = np.empty(len(twists)), np.empty((len(twists), 2))
    here = clearance_at(local, pose[0], pose[1], 0.0)
    velocity = np.empty(2)
    for i in range(len(twists)):
        x, y, time_s = pose[0], pose[1], 0.0
        velocity[:] = now[:2]
        least[i] = np.inf
        for k in range(steps + 1):
            dt = latency_s if k == 0 else step_s
            if k > 0:
                for axis in range(2):
                    most = acceleration[axis] * dt
                    velocity[axis] += min(max((twists[i, axis] - velocity[axis]) * share, -most), most)
            c, s = course[like[i], k, 0], course[like[i], k, 1]
            x += (c * velocity[0] - s * velocity[1]) * dt
            y += (s * velocity[0] + c * velocity[1]) * dt
            time_s += dt
            least[i] = min(least[i], clearance_at(local, x, y, time_s))
        end[i, 0], end[i, 1] = x, y
    return least, end, here
