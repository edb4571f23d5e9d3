"""Clearances of every command in every scenario; the scenario index last.

Source: Han, Zhu, RCSP, section 4.3, algorithm 1 (line 4).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from planners.risk import extremes

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

_ROUNDING = 1e-5  # share by which a squared distance that is worked out in another order may differ, and more


@kernel(fast=True)
def squared_gaps(x: F32, y: F32, box: F32, gap: F32) -> None:
    """Write the squared distances of every motion from the box around an obstacle's futures at each step.

    Args:
        x: of the robot, shape (steps, commands): a loop along the commands is vectorised whatever the horizon is.
        y: likewise.
        box: least x, largest x, least y, largest y at each step, shape (4, steps).
        gap: overwritten, shape (steps, commands).
    """
    zero = np.float32(0.0)
    for k in range(len(gap)):
        left, right, bottom, top, here_x, here_y, out = box[0, k], box[1, k], box[2, k], box[3, k], x[k], y[k], gap[k]
        for u in range(len(out)):
            gap_x, beyond_x = left - here_x[u], here_x[u] - right
            gap_y, beyond_y = bottom - here_y[u], here_y[u] - top
            gap_x, gap_y = gap_x if gap_x > beyond_x else beyond_x, gap_y if gap_y > beyond_y else beyond_y
            gap_x, gap_y = gap_x if gap_x > zero else zero, gap_y if gap_y > zero else zero
            out[u] = gap_x * gap_x + gap_y * gap_y


@kernel(fast=True)
def nearest_squared(x: F32, y: F32, own: F32, steps: NDArray[np.int64], best: F32) -> None:
    """Lower best, shape (scenarios,), to the least squared distance to an obstacle over some steps, four of them at a time.

    Args:
        x: of the robot, shape (horizon,).
        y: likewise.
        own: futures of the obstacle, shape (horizon, 2, scenarios).
        steps: which of the horizon.
        best: lowered where an obstacle is nearer.
    """
    whole = len(steps) // 4 * 4
    for q in range(0, whole, 4):
        a, b, c, d = steps[q], steps[q + 1], steps[q + 2], steps[q + 3]
        ax, bx, cx, dx, ay, by, cy, dy = x[a], x[b], x[c], x[d], y[a], y[b], y[c], y[d]
        own_ax, own_bx, own_cx, own_dx = own[a, 0], own[b, 0], own[c, 0], own[d, 0]
        own_ay, own_by, own_cy, own_dy = own[a, 1], own[b, 1], own[c, 1], own[d, 1]
        for i in range(len(best)):
            to_a = (own_ax[i] - ax) * (own_ax[i] - ax) + (own_ay[i] - ay) * (own_ay[i] - ay)
            to_b = (own_bx[i] - bx) * (own_bx[i] - bx) + (own_by[i] - by) * (own_by[i] - by)
            to_c = (own_cx[i] - cx) * (own_cx[i] - cx) + (own_cy[i] - cy) * (own_cy[i] - cy)
            to_d = (own_dx[i] - dx) * (own_dx[i] - dx) + (own_dy[i] - dy) * (own_dy[i] - dy)
            to_a, to_c = to_a if to_a < to_b else to_b, to_c if to_c < to_d else to_d
            to_a = to_a if to_a < to_c else to_c
            best[i] = to_a if to_a < best[i] else best[i]
    for q in range(whole, len(steps)):
        ax, ay, own_ax, own_ay = x[steps[q]], y[steps[q]], own[steps[q], 0], own[steps[q], 1]
        for i in range(len(best)):
            to_a = (own_ax[i] - ax) * (own_ax[i] - ax) + (own_ay[i] - ay) * (own_ay[i] - ay)
            best[i] = to_a if to_a < best[i] else best[i]


@kernel()
def boxes(own: F32) -> F32:
    """Return the box around all scenarios at each step, shape (4, steps), of futures of shape (steps, 2, scenarios)."""
    box = np.empty((4, len(own)), np.float32)
    for k in range(len(own)):
        box[0, k], box[1, k] = extremes(own[k, 0])
        box[2, k], box[3, k] = extremes(own[k, 1])
    return box


@kernel(fast=True)
def not_below(best: F32, least: np.float32) -> None:
    """Raise squared distances, shape (scenarios,), to a least one."""
    for i in range(len(best)):
        best[i] = best[i] if best[i] > least else least


@kernel(fast=True)
def lower_clearance(best: F32, contact: np.float32, clearance: F32) -> None:
    """Lower clearances, shape (scenarios,), to what least squared distances to one more obstacle leave."""
    for i in range(len(best)):
        c = np.sqrt(best[i]) - contact
        clearance[i] = c if c < clearance[i] else clearance[i]


@kernel()
def with_rest(motion: F32, rest: F32, steps: int) -> F32:
    """Return one coordinate of every motion, shape (commands, horizon), with where it rests, (commands,), for what follows."""
    whole = np.empty((len(motion), steps), np.float32)
    for u in range(len(motion)):
        for k in range(steps):
            whole[u, k] = motion[u, k] if k < motion.shape[1] else rest[u]
    return whole


@kernel(fast=True)
def count_near(gap: F32, limit: np.float32, count: F32) -> None:
    """Write how many steps of each command are nearer than a squared distance: gap (steps, commands), count (commands,)."""
    one, zero = np.float32(1.0), np.float32(0.0)
    count[:] = zero
    for k in range(len(gap)):
        own = gap[k]
        for u in range(len(count)):
            count[u] += one if own[u] < limit else zero


@kernel()
def list_near(gap: F32, limit: np.float32, u: int, near: NDArray[np.int64]) -> None:
    """Write which steps of command u are nearer than a squared distance, from the front of near, shape (steps + 1,)."""
    count = 0
    for k in range(len(gap)):
        near[count] = k
        count += gap[k, u] < limit


@kernel()
def clearances(x: F32, y: F32, rest: F32, futures: F32, contact: F32, far_m: float) -> F32:
    """Return the least clearance of each command in each scenario over time and obstacles, shape (commands, scenarios).

    After the horizon the robot stands, and who then touches it is at a clearance of zero, not below: a command that leads to
    where somebody comes has led into a trap; it is a near miss and no collision yet, as there is time to leave.

    Nothing farther than `far_m` is looked at: it is what is returned there.  One obstacle at a time, so that its futures stay
    in the first-level cache while all commands are held against them.

    Args:
        x: of the robot, shape (commands, horizon).
        y: likewise.
        rest: where each command comes to rest, shape (commands, 2).
        futures: shape (steps, obstacles, 2, scenarios), the horizon first.
        contact: distance of the centres at contact, shape (obstacles,).
        far_m: clearance that matters.
    """
    (steps, obstacles, _, n), (commands, horizon) = futures.shape, x.shape
    clearance = np.full((commands, n), np.float32(far_m))
    if n == 0:
        return clearance
    own, best, near = np.empty((steps, 2, n), np.float32), np.empty(n, np.float32), np.empty(horizon + 1, np.int64)
    whole_x, whole_y = with_rest(x, rest[:, 0], steps), with_rest(y, rest[:, 1], steps)
    across_x, across_y, gap = whole_x.T.copy(), whole_y.T.copy(), np.empty((steps, commands), np.float32)
    under_way, at_rest, all_steps = np.empty(commands, np.float32), np.empty(commands, np.float32), np.arange(steps)
    for m in range(obstacles):
        for k in range(steps):
            for axis in range(2):
                for i in range(n):
                    own[k, axis, i] = futures[k, m, axis, i]
        squared_gaps(across_x, across_y, boxes(own), gap)
        far = (contact[m] + np.float32(far_m)) * (contact[m] + np.float32(far_m))
        limit = far * np.float32(1.0 + _ROUNDING)
        count_near(gap[:horizon], limit, under_way)
        count_near(gap[horizon:], limit, at_rest)
        for u in range(commands):
            count, x_u, y_u = int(under_way[u]), whole_x[u], whole_y[u]
            if count == 0 and at_rest[u] == 0:
                continue
            best[:] = far
            if at_rest[u] > 0:
                nearest_squared(x_u, y_u, own, all_steps[horizon:], best)
                not_below(best, contact[m] * contact[m])  # the root of a square, each rounded, is the number itself
            if count == horizon:
                nearest_squared(x_u, y_u, own, all_steps[:horizon], best)
            elif count > 0:
                list_near(gap[:horizon], limit, u, near)
                nearest_squared(x_u, y_u, own, near[:count], best)
            lower_clearance(best, contact[m], clearance[u])
    return clearance


@kernel()
def least_gap(state: F64, contact: F64, x: float, y: float) -> float:
    """Return the least clearance of the robot from obstacles, states of shape (obstacles, 4); infinite where there are none."""
    least = np.inf
    for m in range(len(state)):
        least = min(least, np.hypot(state[m, 0] - x, state[m, 1] - y) - contact[m])
    return least
