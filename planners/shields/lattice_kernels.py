"""Short rollouts of many twists past what stands still and what moves, each with two ways to go on afterwards.

Source: Han, Zhu, RCSP, section 4.4; that a motion is safe only with a way to go on from it: Fraichard, Asama, Inevitable
collision states, a step towards safer robots?, Advanced Robotics 18(10), 2004.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.field_query import bilinear
from planners.shields.lattice_answer_kernels import Answer, approached, courses, shares

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]


State = tuple[float, float, float, float, float, float, float]  # x, y, vx, vy, what is sent for both, static clearance at least

_STEEPEST = 1.5  # no interpolated field of distances falls by more per metre


class Local(NamedTuple):
    """What is around the robot; odom frame."""

    clearance: F32  # (rows, columns), to what stands still
    corner_x: float
    corner_y: float
    cell_m: float
    where: F32  # (1 + 1 + steps + after_steps, n, 2): who moves, now and at the end of latency and steps
    contact_m: F64  # (n,), distance of the centres
    radius_m: float
    far_m: float  # clearance beyond which more is worth nothing


@kernel()
def static_at(local: Local, x: float, y: float) -> float:
    """Return the clearance to what stands still at a place, surface to surface [m]; negative where they overlap."""
    c: float = bilinear(local.clearance, local.corner_x, local.corner_y, local.cell_m, x, y) - local.radius_m
    return c


@kernel()
def past_movers(local: Local, x: float, y: float, look: int, least: float) -> float:
    """Return the clearance to who moves at a place and look, or `least` where that is less [m]; no root is taken for the far."""
    where = local.where[look]
    for i in range(len(local.contact_m)):
        dx, dy, reach = where[i, 0] - x, where[i, 1] - y, max(least + local.contact_m[i], 0.0)
        squared = dx * dx + dy * dy
        if squared < reach * reach:
            least = np.sqrt(squared) - local.contact_m[i]
    return least


@kernel()
def driven(
    local: Local, course: F64, first: int, last: int, dt: float, state: State, target_x: float, target_y: float,
    most_x: float, most_y: float, share: float,
) -> tuple[float, State]:  # fmt: skip
    """Drive along a course from look `first` to `last`; return the least clearance, up to `far_m`, and the state then.

    What stands still is looked up again only where it may have come nearer than the least clearance so far.
    """
    x, y, vx, vy, sent_x, sent_y, free = state
    least = local.far_m
    for k in range(first, last):
        now_x, sent_x = approached(vx, sent_x, target_x, most_x, share)
        now_y, sent_y = approached(vy, sent_y, target_y, most_y, share)
        c, s, ahead, aside = course[k, 0], course[k, 1], 0.5 * (vx + now_x) * dt, 0.5 * (vy + now_y) * dt
        x, y, vx, vy = x + c * ahead - s * aside, y + s * ahead + c * aside, now_x, now_y
        free -= _STEEPEST * (abs(ahead) + abs(aside))
        least = past_movers(local, x, y, k, least)
        if free < least:
            free = static_at(local, x, y)
            least = min(least, free)
    return least, (x, y, vx, vy, sent_x, sent_y, free)


@kernel()
def forecast(pose: F64, now: F64, sent: F64, twists: F64, answer: Answer, local: Local) -> tuple[F64, F64, float]:
    """Drive every twist from the present motion; return least clearance, shape (n,), where the steps end, (n, 2), and that now.

    After the steps the robot goes on with the twist or stops, whichever keeps clear of more.

    Args:
        pose: x, y, yaw in odom, shape (3,).
        now: vx, vy, wz driven now, shape (3,).
        sent: the twist sent last, shape (3,).
        twists: asked, shape (n, 3).
        answer: of the base.
        local: surroundings.
    """
    on, off, row = courses(pose[2], now[2], sent[2], twists[:, 2].copy(), answer)
    first, second, third = shares(answer)
    till, looks, dt, after = 2 + answer.steps, 2 + answer.steps + answer.after_steps, answer.step_s, answer.after_step_s
    a_x, a_y = answer.acceleration[0], answer.acceleration[1]
    least, end = np.empty(len(twists)), np.empty((len(twists), 2))
    static = static_at(local, pose[0], pose[1])
    here = past_movers(local, pose[0], pose[1], 0, min(static, local.far_m))
    start = (pose[0], pose[1], now[0], now[1], sent[0], sent[1], static)
    c0, begun = driven(local, on[0], 1, 2, answer.latency_s, start, sent[0], sent[1], 0.0, 0.0, first)
    for i in range(len(twists)):
        vx, vy = twists[i, 0], twists[i, 1]
        c, state = driven(local, on[row[i]], 2, till, dt, begun, vx, vy, a_x * dt, a_y * dt, second)
        end[i, 0], end[i, 1] = state[0], state[1]
        c = min(c, c0)
        going, _ = driven(local, on[row[i]], till, looks, after, state, vx, vy, a_x * after, a_y * after, third)
        if going < c:
            stopping, _ = driven(local, off[row[i]], till, looks, after, state, 0.0, 0.0, a_x * after, a_y * after, third)
            going = max(going, stopping)
        least[i] = min(c, going)
    return least, end, here
