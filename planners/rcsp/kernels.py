"""Clearances of every command in every scenario, their tails, and progress along the route; the scenario index last.

Source: Han, Zhu, RCSP, section 4.3, algorithm 1 (lines 4 and 5).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from planners.prediction.kernels import Draws, advance
from planners.risk import gather_smallest

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
def nearest_squared(x: F32, y: F32, own: F32, box: F32, reach: np.float32, best: F32) -> bool:
    """Lower best, shape (scenarios,), to the least squared distances between robot, x and y of shape (steps,), and obstacle.

    Args:
        x: of the robot.
        y: likewise.
        own: futures of the obstacle, shape (steps, 2, scenarios).
        box: least x, largest x, least y, largest y of them at each step, shape (steps, 4); a step whose box is out of reach
            is passed over.
        reach: distance that matters.
        best: lowered where an obstacle is nearer.

    Returns:
        Whether any step was in reach.
    """
    touched = False
    n = own.shape[2]
    zero = np.float32(0.0)
    for k in range(len(x)):
        px, py = x[k], y[k]
        gap_x, gap_y = max(box[k, 0] - px, px - box[k, 1], zero), max(box[k, 2] - py, py - box[k, 3], zero)
        if gap_x * gap_x + gap_y * gap_y >= reach * reach:
            continue
        touched = True
        ox, oy = own[k, 0], own[k, 1]
        for i in range(n):
            dx, dy = ox[i] - px, oy[i] - py
            d = dx * dx + dy * dy
            best[i] = d if d < best[i] else best[i]
    return touched


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def boxes(own: F32) -> F32:
    """Return the box around all scenarios at each step, shape (steps, 4), of futures of shape (steps, 2, scenarios)."""
    steps, _, n = own.shape
    box = np.empty((steps, 4), np.float32)
    for k in range(steps):
        for axis in range(2):
            low, high = own[k, axis, 0], own[k, axis, 0]
            for i in range(1, n):
                v = own[k, axis, i]
                low = v if v < low else low
                high = v if v > high else high
            box[k, 2 * axis], box[k, 2 * axis + 1] = low, high
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
    own, best = np.empty((steps, 2, n), np.float32), np.empty(n, np.float32)
    for m in range(obstacles):
        for k in range(steps):
            for axis in range(2):
                for i in range(n):
                    own[k, axis, i] = futures[k, m, axis, i]
        box, reach = boxes(own), contact[m] + np.float32(far_m)
        for u in range(len(x)):
            best[:] = reach * reach
            if nearest_squared(x[u], y[u], own, box, reach, best):
                lower_clearance(best, contact[m], clearance[u])
    return clearance


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def reacting_clearances(x: F32, y: F32, draws: Draws, steps_s: F64, far_m: float) -> F32:
    """Return the same where every obstacle reacts to each command: its futures are made anew for each."""
    obstacles, _, n = draws.position.shape
    steps = len(steps_s)
    clearance = np.full((len(x), n), np.float32(far_m))
    own, best, robot = np.empty((steps, 2, n), np.float32), np.empty(n, np.float32), np.empty((steps, 2), np.float32)
    for u in range(len(x)):
        robot[:, 0], robot[:, 1] = x[u], y[u]
        for m in range(obstacles):
            advance(draws, m, steps_s, robot, own)
            reach = draws.contact_m[m] + np.float32(far_m)
            best[:] = reach * reach
            if nearest_squared(x[u], y[u], own, boxes(own), reach, best):
                lower_clearance(best, draws.contact_m[m], clearance[u])
    return clearance


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def tails(
    clearance: F32, static_m: F32, brakable: NDArray[np.bool_], count: int, risk: Risk, static_safe_m: float
) -> tuple[F64, F64, NDArray[np.bool_]]:
    """Return of every command: the mean risk of its tail, the tail's mean clearance, and whether the tail is free.

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
        Shapes (commands,); a tail is free where fewer than `count` scenarios meet an obstacle.
    """
    commands, n = clearance.shape
    tail, room, free = np.empty(commands), np.empty(commands), np.empty(commands, np.bool_)
    for u in range(commands):
        floor = risk_of(static_m[u] if brakable[u] else -np.inf, static_safe_m, risk)
        row = clearance[u]
        tail[u], room[u], free[u] = floor, min(risk.safe_m, static_m[u]), brakable[u]
        if n == 0 or row.min() >= risk.safe_m:
            continue
        gather_smallest(row, count)
        total, width, edge = 0.0, 0.0, row[0]
        for i in range(count):
            total += max(floor, risk_of(row[i], risk.safe_m, risk))
            width += row[i]
            edge = max(edge, row[i])
        tail[u], room[u], free[u] = total / count, min(width / count, static_m[u]), edge >= 0.0 and brakable[u]
    return tail, room, free


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def mean_risk(clearance: F32, static_m: float, brakable: bool, risk: Risk, static_safe_m: float) -> float:
    """Return the mean risk of one command over the scenarios, shape (scenarios,)."""
    floor = risk_of(static_m if brakable else -np.inf, static_safe_m, risk)
    total = 0.0
    for i in range(len(clearance)):
        total += max(floor, risk_of(clearance[i], risk.safe_m, risk))
    return total / len(clearance) if len(clearance) else floor


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def to_go(x: F32, y: F32, yaw: F32, path: F64, along: F64, lateral: float, heading: float, look_ahead_m: float) -> F64:
    """Return the way that is left from each pose, shape (n,) [m]: along the route from the nearest point of it, plus what
    lying beside it and facing away from where it leads cost.

    Args:
        x: of the poses, shape (n,).
        y: likewise.
        yaw: likewise.
        path: the route, shape (m, 2).
        along: distance of its points along it, shape (m,).
        lateral: metres per metre beside it.
        heading: metres per radian that the pose faces away from the point `look_ahead_m` farther along.
        look_ahead_m: at the route's end the heading counts no more.
    """
    left = np.empty(len(x))
    last = len(path) - 1
    for i in range(len(x)):
        nearest, at = np.inf, 0.0
        for j in range(last):
            ax, ay = path[j + 1, 0] - path[j, 0], path[j + 1, 1] - path[j, 1]
            squared = ax * ax + ay * ay
            t = ((x[i] - path[j, 0]) * ax + (y[i] - path[j, 1]) * ay) / squared if squared > 0.0 else 0.0
            t = min(max(t, 0.0), 1.0)
            dx, dy = x[i] - path[j, 0] - t * ax, y[i] - path[j, 1] - t * ay
            d = dx * dx + dy * dy
            if d < nearest:
                nearest, at = d, along[j] + t * (along[j + 1] - along[j])
        wanted = min(at + look_ahead_m, along[last])
        j = min(np.searchsorted(along, wanted), last)
        bearing = np.arctan2(path[j, 1] - y[i], path[j, 0] - x[i]) - yaw[i]
        off = abs((bearing + np.pi) % (2.0 * np.pi) - np.pi)
        near_end = min(1.0, (along[last] - at) / look_ahead_m)
        left[i] = along[last] - at + lateral * np.sqrt(nearest) + heading * near_end * off
    return left


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def first_conflict(x: F32, y: F32, futures: F32, contact: F32, count: int) -> int:
    """Return the first step at which a motion of shape (steps,) touches an obstacle in `count` scenarios or more; -1: never."""
    steps, obstacles, _, n = futures.shape
    hit = np.zeros(n, np.bool_)
    for k in range(steps):
        for m in range(obstacles):
            for i in range(n):
                dx, dy = futures[k, m, 0, i] - x[k], futures[k, m, 1, i] - y[k]
                hit[i] |= dx * dx + dy * dy < contact[m] * contact[m]
        if hit.sum() >= count:
            return k
    return -1


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def by_conjecture(
    position: F32, which: NDArray[np.int64], conjectures: int, every: int, shown: int
) -> tuple[F64, NDArray[np.int64]]:
    """Return every so many steps of the first scenarios, shape (dots, 2), ordered by conjecture, and where each one's end."""
    steps, obstacles, _, n = position.shape
    n = min(n, shown)
    dots, edges = np.empty((steps // every * obstacles * n, 2)), np.zeros(conjectures + 1, np.int64)
    at = 0
    for c in range(conjectures):
        for m in range(obstacles):
            for i in range(n):
                if which[m, i] == c:
                    for k in range(every - 1, steps, every):
                        dots[at, 0], dots[at, 1] = position[k, m, 0, i], position[k, m, 1, i]
                        at += 1
        edges[c + 1] = at
    return dots, edges
