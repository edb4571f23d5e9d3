"""Clearances of every command in every scenario, and their tails; the scenario index last.

Source: Han, Zhu, RCSP, section 4.3, algorithm 1 (lines 4 and 5).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planners.prediction.kernels import Draws, advance
from planners.risk import count_within, extremes, gather_smallest

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]
FAST = {"contract", "reassoc", "arcp", "nsz"}

INVERSE_CLEARANCE, VIOLATION, NEAR_MISS = 0, 1, 2


class Risk(NamedTuple):
    """g_risk as a function of clearance; it falls with it, so that its maximum over the horizon is at the least clearance."""

    kind: int
    safe_m: float  # beyond it there is no risk
    collision: float
    depth_m: float


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def risk_of(clearance_m: float, safe_m: float, risk: Risk) -> float:
    """Return g_risk, in [0, `largest(risk)`]: zero from safe_m on.

    - violation: 1 - c / safe, down to an overlap of depth_m;
    - inverse clearance: safe / c - 1 down to the clearance at which it has grown to the collision penalty;
    - near miss: (1 - c / safe)^2, and where surfaces meet the penalty of a collision and the overlap on top.
    """
    c = max(clearance_m, -risk.depth_m)
    if c >= safe_m:
        return 0.0
    if risk.kind == VIOLATION:
        return 1.0 - c / safe_m
    if risk.kind == INVERSE_CLEARANCE:
        least = safe_m / (1.0 + risk.collision)
        return safe_m / max(c, least) - 1.0 + max(0.0, -c) / risk.depth_m
    if c >= 0.0:
        return (1.0 - c / safe_m) * (1.0 - c / safe_m)
    return 1.0 + risk.collision - c / risk.depth_m


def largest(risk: Risk, safe_m: float) -> float:
    """Return B_G, the largest risk there is."""
    return float(risk_of(-np.inf, safe_m, risk))


@njit(cache=True, nogil=True, fastmath=FAST)  # type: ignore[untyped-decorator]
def in_reach(x: F32, y: F32, box: F32, reach: np.float32, gap: F32, steps: NDArray[np.int64]) -> int:
    """Write the steps at which a motion, x and y of shape (steps,), comes within reach of a box; return how many they are.

    Args:
        x: of the robot.
        y: likewise.
        box: least x, largest x, least y, largest y at each step, shape (4, steps).
        reach: distance that matters.
        gap: overwritten, shape (steps,).
        steps: overwritten from the front, shape (steps,).
    """
    zero = np.float32(0.0)
    left, right, bottom, top = box[0], box[1], box[2], box[3]
    for k in range(len(x)):
        gap_x, beyond_x = left[k] - x[k], x[k] - right[k]
        gap_y, beyond_y = bottom[k] - y[k], y[k] - top[k]
        gap_x, gap_y = gap_x if gap_x > beyond_x else beyond_x, gap_y if gap_y > beyond_y else beyond_y
        gap_x, gap_y = gap_x if gap_x > zero else zero, gap_y if gap_y > zero else zero
        gap[k] = gap_x * gap_x + gap_y * gap_y
    count, limit = 0, reach * reach
    for k in range(len(x)):
        steps[count] = k
        count += 1 if gap[k] < limit else 0
    return count


@njit(cache=True, nogil=True, fastmath=FAST)  # type: ignore[untyped-decorator]
def nearest_squared(x: F32, y: F32, own: F32, steps: NDArray[np.int64], best: F32) -> None:
    """Lower best, shape (scenarios,), to the least squared distance to an obstacle over some steps, four of them at a time.

    Args:
        x: of the robot, shape (horizon,).
        y: likewise.
        own: futures of the obstacle, shape (horizon, 2, scenarios).
        steps: which of the horizon, at least one.
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


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def boxes(own: F32) -> F32:
    """Return the box around all scenarios at each step, shape (4, steps), of futures of shape (steps, 2, scenarios)."""
    box = np.empty((4, len(own)), np.float32)
    for k in range(len(own)):
        box[0, k], box[1, k] = extremes(own[k, 0])
        box[2, k], box[3, k] = extremes(own[k, 1])
    return box


@njit(cache=True, nogil=True, fastmath=FAST)  # type: ignore[untyped-decorator]
def lower_clearance(best: F32, contact: np.float32, clearance: F32) -> None:
    """Lower clearances, shape (scenarios,), to what least squared distances to one more obstacle leave."""
    for i in range(len(best)):
        c = np.sqrt(best[i]) - contact
        clearance[i] = c if c < clearance[i] else clearance[i]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def clearances(x: F32, y: F32, futures: F32, contact: F32, far_m: float) -> F32:
    """Return the least clearance of each command in each scenario over horizon and obstacles, shape (commands, scenarios).

    Nothing farther than `far_m` is looked at: it is what is returned there.  One obstacle at a time, so that its futures stay
    in the first-level cache while all commands are held against them.

    Args:
        x: of the robot, shape (commands, steps).
        y: likewise.
        futures: shape (steps, obstacles, 2, scenarios).
        contact: distance of the centres at contact, shape (obstacles,).
        far_m: clearance that matters.
    """
    steps, obstacles, _, n = futures.shape
    clearance = np.full((len(x), n), np.float32(far_m))
    if n == 0:
        return clearance
    own, best, near = np.empty((steps, 2, n), np.float32), np.empty(n, np.float32), np.empty(steps, np.int64)
    gap = np.empty(steps, np.float32)
    for m in range(obstacles):
        for k in range(steps):
            for axis in range(2):
                for i in range(n):
                    own[k, axis, i] = futures[k, m, axis, i]
        box, reach = boxes(own), contact[m] + np.float32(far_m)
        for u in range(len(x)):
            count = in_reach(x[u], y[u], box, reach, gap, near)
            if count > 0:
                best[:] = reach * reach
                nearest_squared(x[u], y[u], own, near[:count], best)
                lower_clearance(best, contact[m], clearance[u])
    return clearance


@njit(cache=True, nogil=True, fastmath=FAST)  # type: ignore[untyped-decorator]
def lower_at_rest(rest: F32, futures: F32, contact: F32, far_m: float, clearance: F32) -> None:
    """Lower clearances, shape (commands, scenarios), to what a robot that stands after the horizon has, but not below zero.

    A command that leads to where somebody comes has led into a trap; it is a near miss and no collision yet, as there is time
    to leave.

    Args:
        rest: where each command comes to rest, shape (commands, 2).
        futures: after the horizon, shape (steps, obstacles, 2, scenarios).
        contact: distance of the centres at contact, shape (obstacles,).
        far_m: clearance that matters.
        clearance: over the horizon, lowered, shape (commands, scenarios).
    """
    steps, obstacles, _, n = futures.shape
    if steps == 0 or n == 0:
        return
    zero, best, own, all_steps = np.float32(0.0), np.empty(n, np.float32), np.empty((steps, 2, n), np.float32), np.arange(steps)
    x, y, here = np.empty(steps, np.float32), np.empty(steps, np.float32), np.empty(2, np.float32)
    for m in range(obstacles):
        own[:] = futures[:, m]
        box, reach = boxes(own), contact[m] + np.float32(far_m)
        left, right, bottom, top = box[0].min() - reach, box[1].max() + reach, box[2].min() - reach, box[3].max() + reach
        for u in range(len(rest)):
            here[:] = rest[u]
            if here[0] < left or here[0] > right or here[1] < bottom or here[1] > top:
                continue
            best[:], x[:], y[:] = reach * reach, here[0], here[1]
            nearest_squared(x, y, own, all_steps, best)
            row = clearance[u]
            for i in range(n):
                c = np.sqrt(best[i]) - contact[m]
                c = c if c > zero else zero
                row[i] = c if c < row[i] else row[i]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def reacting_clearances(x: F32, y: F32, draws: Draws, steps_s: F64, far_m: float) -> F32:
    """Return the same where every obstacle reacts to each command: its futures are made anew for each."""
    obstacles, _, n = draws.position.shape
    steps = len(steps_s)
    clearance = np.full((len(x), n), np.float32(far_m))
    own, best, robot = np.empty((steps, 2, n), np.float32), np.empty(n, np.float32), np.empty((steps, 2), np.float32)
    all_steps = np.arange(steps)
    for u in range(len(x)):
        robot[:, 0], robot[:, 1] = x[u], y[u]
        for m in range(obstacles):
            advance(draws, m, steps_s, robot, own)
            reach = draws.contact_m[m] + np.float32(far_m)
            best[:] = reach * reach
            nearest_squared(x[u], y[u], own, all_steps, best)
            lower_clearance(best, draws.contact_m[m], clearance[u])
    return clearance


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def tails(
    clearance: F32, static_m: F32, brakable: NDArray[np.bool_], count: int, risk: Risk, static_safe_m: float
) -> tuple[F64, F64, NDArray[np.bool_]]:
    """Return of every command: the mean risk of its tail, the tail's mean clearance, and whether it is free.

    The tail is the `count` scenarios of least clearance.  A command from which the robot cannot brake in time for what stands
    still collides in every scenario.

    Args:
        clearance: shape (commands, scenarios); reordered, the tail first.
        static_m: clearance to what stands still, shape (commands,).
        brakable: shape (commands,).
        count: of scenarios in the tail.
        risk: of what moves, and in its form of what stands still.
        static_safe_m: clearance beyond which what stands still is no risk.

    Returns:
        Shapes (commands,); free is what meets an obstacle, under way or where it then stands, in fewer than `count` scenarios.
    """
    commands, n = clearance.shape
    tail, room, free = np.empty(commands), np.empty(commands), np.empty(commands, np.bool_)
    below_safe = np.nextafter(np.float32(risk.safe_m), np.float32(-1.0))
    for u in range(commands):
        floor = risk_of(static_m[u] if brakable[u] else -np.inf, static_safe_m, risk)
        row = clearance[u]
        tail[u], room[u], free[u] = floor, min(risk.safe_m, static_m[u]), brakable[u]
        if n == 0 or count_within(row, below_safe) == 0.0:
            continue
        gather_smallest(row, count)
        total, width, edge = 0.0, 0.0, row[0]
        for i in range(count):
            total += max(floor, risk_of(row[i], risk.safe_m, risk))
            width += row[i]
            edge = max(edge, row[i])
        tail[u], room[u], free[u] = total / count, min(width / count, static_m[u]), edge > 0.0 and brakable[u]
    return tail, room, free


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def mean_risks(clearance: F32, static_m: F32, brakable: NDArray[np.bool_], risk: Risk, static_safe_m: float) -> F64:
    """Return the mean risk of every command over the scenarios, shape (commands,); the arguments are those of `tails`.

    Who is touched where it stands after the horizon, at a clearance of zero, has time to leave, but maybe no way: it is taken
    for half a collision.
    """
    commands, n = clearance.shape
    mean, trapped = np.empty(commands), 0.5 * (risk_of(0.0, risk.safe_m, risk) + risk_of(-1e-6, risk.safe_m, risk))
    for u in range(commands):
        floor = risk_of(static_m[u] if brakable[u] else -np.inf, static_safe_m, risk)
        total = 0.0
        for i in range(n):
            c = clearance[u, i]
            total += max(floor, trapped if c == 0.0 else risk_of(c, risk.safe_m, risk))
        mean[u] = total / n if n else floor
    return mean


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def least_gap(state: F64, contact: F64, x: float, y: float) -> float:
    """Return the least clearance of the robot from obstacles, states of shape (obstacles, 4); infinite where there are none."""
    least = np.inf
    for m in range(len(state)):
        least = min(least, np.hypot(state[m, 0] - x, state[m, 1] - y) - contact[m])
    return least
