"""Arcs, their free length and their worth; arrays in, arrays out.

Source: Fox, Burgard, Thrun, The dynamic window approach to collision avoidance, IEEE RAM 1997, sections III and IV.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import UNKNOWN
from estimators.field_query import bilinear

F64 = NDArray[np.float64]


class Surroundings(NamedTuple):
    """What an arc is laid through; lengths in metres, odom frame."""

    clearance: NDArray[np.float32]  # (rows, columns)
    label: NDArray[np.uint8]  # (rows, columns)
    corner_x: float
    corner_y: float
    cell_m: float
    required_m: float  # least clearance of the robot's centre
    body_m: float  # kept from unknown cells; negative: they count as free


class Objective(NamedTuple):
    """What is preferred."""

    carrot: F64  # (2,), in odom
    progress_s: float  # when progress is judged
    facing_s: float  # when the heading is judged
    comfort_m: float
    max_speed_m_s: float
    slowing: float  # 0 to 1: how much of the speed term is left near the goal
    weights: F64  # (6,): progress, facing, clearance, speed, blind, change


@kernel()
def advance(pose: F64, twist: F64, time_s: float) -> tuple[float, float, float]:
    """Return x, y, yaw after moving with a constant body twist, shape (3,), from a pose, shape (3,), along the exact arc."""
    angle = twist[2] * time_s
    if abs(angle) < 1e-6:
        a, b = 1.0, 0.5 * angle
    else:
        a, b = np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle
    forward, left = (a * twist[0] - b * twist[1]) * time_s, (b * twist[0] + a * twist[1]) * time_s
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return pose[0] + c * forward - s * left, pose[1] + s * forward + c * left, pose[2] + angle


@kernel()
def is_unknown(around: Surroundings, x: float, y: float) -> bool:
    """Return whether a point was never seen; outside the grid nothing was."""
    row = int(np.floor((y - around.corner_y) / around.cell_m))
    column = int(np.floor((x - around.corner_x) / around.cell_m))
    rows, columns = around.label.shape
    return not (0 <= row < rows and 0 <= column < columns) or around.label[row, column] == UNKNOWN


@kernel()
def free_travel(pose: F64, twist: F64, length_m: float, steps: int, around: Surroundings) -> tuple[float, float]:
    """Return how far the robot's centre can go along the arc before its clearance is short, and the least clearance till there.

    The arc's step is an exact displacement, turned by the same angle again and again.  The point where the clearance falls short
    is interpolated between steps; `length_m` when it never does.
    """
    speed = np.hypot(twist[0], twist[1])
    step_m = length_m / steps
    x, y, yaw = advance(np.zeros(3), twist, step_m / speed)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    dx, dy = c * x - s * y, s * x + c * y
    c, s = np.cos(yaw), np.sin(yaw)
    x, y = pose[0], pose[1]
    before = bilinear(around.clearance, around.corner_x, around.corner_y, around.cell_m, x, y)
    least = before
    for k in range(steps):
        x, y = x + dx, y + dy
        dx, dy = c * dx - s * dy, s * dx + c * dy
        here = bilinear(around.clearance, around.corner_x, around.corner_y, around.cell_m, x, y)
        if here < around.required_m:
            part = max(0.0, before - around.required_m) / (before - here) if before > here else 0.0
            return (k + part) * step_m, around.required_m
        if 0.0 <= around.body_m < (k + 1) * step_m and is_unknown(around, x, y):
            return max(0.0, k * step_m - around.body_m), least
        before, least = here, min(least, here)
    return length_m, least


@kernel()
def worth(pose: F64, twist: F64, now: F64, free_m: float, least_m: float, required_m: float, goal: Objective) -> float:
    """Return the objective of one velocity, shape (3,): the sum that section IV-B maximises, with terms for an omni base."""
    speed = np.hypot(twist[0], twist[1])
    time_s = min(goal.progress_s, free_m / speed) if speed > 0.0 else goal.progress_s
    x, y, _ = advance(pose, twist, time_s)
    distance_now = np.hypot(goal.carrot[0] - pose[0], goal.carrot[1] - pose[1])
    distance = np.hypot(goal.carrot[0] - x, goal.carrot[1] - y)
    progress = (distance_now - distance) / (goal.max_speed_m_s * goal.progress_s)
    bearing = np.arctan2(goal.carrot[1] - pose[1], goal.carrot[0] - pose[0]) - pose[2] - twist[2] * goal.facing_s
    facing = 1.0 - abs((bearing + np.pi) % (2.0 * np.pi) - np.pi) / np.pi
    room = min(max((least_m - required_m) / goal.comfort_m, 0.0), 1.0)
    blind = 0.5 * (speed - twist[0]) / goal.max_speed_m_s  # speed * (1 - cos(direction of travel)) / 2
    change = np.hypot(twist[0] - now[0], twist[1] - now[1]) / goal.max_speed_m_s + 0.2 * abs(twist[2] - now[2])
    w = goal.weights
    gain = w[0] * progress + w[1] * facing + w[2] * room + w[3] * goal.slowing * speed / goal.max_speed_m_s
    return float(gain - w[4] * blind - w[5] * change)


@kernel()
def choose(
    pose: F64, now: F64, samples: F64, stop_deceleration: F64, reaction_s: float, horizon_s: float, least_look_m: float,
    steps: int, around: Surroundings, goal: Objective,
) -> tuple[int, int, float, float]:  # fmt: skip
    """Return index of the best admissible velocity (-1: none), number of admissible ones, its worth and its free length [m].

    A velocity is admissible when the base can stop within the free length of its arc (section III-B): after the reaction
    time all axes brake at once, and the slowest to stop decides.

    Args:
        pose: x, y, yaw in odom, shape (3,).
        now: twist driven now, shape (3,).
        samples: twists to try, shape (n, 3).
        stop_deceleration: of vx and vy [m/s^2], shape (2,).
        reaction_s: driven on before the brake takes hold.
        horizon_s: an arc is as long as it takes in this time,
        least_look_m: but at least so long, that slow arcs see what they creep up to.
        steps: points along an arc.
        around: what the arcs are laid through.
        goal: what is preferred.
    """
    best, admissible, best_worth, best_free = -1, 0, -np.inf, 0.0
    here = bilinear(around.clearance, around.corner_x, around.corner_y, around.cell_m, pose[0], pose[1])
    for i in range(len(samples)):
        twist = samples[i]
        speed = np.hypot(twist[0], twist[1])
        free_m, least_m = np.inf, here
        if speed > 1e-9:
            free_m, least_m = free_travel(pose, twist, max(speed * horizon_s, least_look_m), steps, around)
            stop_s = max(abs(twist[0]) / stop_deceleration[0], abs(twist[1]) / stop_deceleration[1])
            if speed * (reaction_s + 0.5 * stop_s) > free_m:
                continue
        admissible += 1
        value = worth(pose, twist, now, free_m, least_m, around.required_m, goal)
        if value > best_worth:
            best, best_worth, best_free = i, value, free_m
    return best, admissible, best_worth, best_free


@kernel()
def visible_along(path: F64, look_ahead_m: float, around: Surroundings) -> int:
    """Return the farthest point of the path, shape (n, 2), within the look-ahead that a straight line from its start reaches.

    A point behind a corner would draw the robot into the corner.  At least the first point after the start is returned.
    """
    along, best = 0.0, 1
    for i in range(1, len(path)):
        along += np.hypot(path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1])
        if along > look_ahead_m and i > 1:
            break
        dx, dy = path[i, 0] - path[0, 0], path[i, 1] - path[0, 1]
        checks = max(1, int(np.ceil(np.hypot(dx, dy) / around.cell_m)))
        clear = True
        for k in range(1, checks + 1):
            x, y = path[0, 0] + dx * k / checks, path[0, 1] + dy * k / checks
            if bilinear(around.clearance, around.corner_x, around.corner_y, around.cell_m, x, y) < around.required_m:
                clear = False
                break
        if clear:
            best = i
    return best
