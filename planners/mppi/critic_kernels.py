"""The critics: each adds what it charges to the costs of the trajectories, shape (batch,).

Source: nav2_mppi_controller.  Trajectories are x, y, yaw, each of shape (steps, batch), controls have shape (3, steps, batch),
the path has shape (n, 2), all float32 and in odom.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
Mask = NDArray[np.bool_]

FREE, INSCRIBED = 0.0, 253.0  # a costmap's values; from `INSCRIBED` on the robot touches something


class Costmap(NamedTuple):
    """Inflated costs and where they lie, in odom."""

    cost: F32  # (rows, columns)
    corner_x: np.float32
    corner_y: np.float32
    per_m: np.float32  # cells


@kernel()
def inflate(clearance: F32, required_m: float, radius_m: float, scaling: float, cost: F32) -> None:
    """Write the costs of a costmap's inflation layer, shape (rows, columns), of places with that much clearance.

    Up to `radius_m` they fall from 252, by e per 1 / `scaling` metres, where clearance exceeds `required_m`.
    """
    rows, columns = clearance.shape
    for row in range(rows):
        for column in range(columns):
            d = clearance[row, column]
            if d < required_m:
                cost[row, column] = INSCRIBED
            elif d < radius_m:
                cost[row, column] = (INSCRIBED - 1.0) * np.exp(-scaling * (d - required_m))
            else:
                cost[row, column] = FREE


@kernel()
def cost_at(around: Costmap, x: np.float32, y: np.float32) -> float:
    """Return the cost of the cell around (x, y); outside the map there is nothing known to collide with."""
    column, row = int(np.floor((x - around.corner_x) * around.per_m)), int(np.floor((y - around.corner_y) * around.per_m))
    if 0 <= row < around.cost.shape[0] and 0 <= column < around.cost.shape[1]:
        return float(around.cost[row, column])
    return FREE


@kernel()
def collision_free(around: Costmap, points: F32) -> Mask:
    """Return which of the points, shape (n, 2), the robot's centre may be at, shape (n,)."""
    free = np.empty(len(points), np.bool_)
    for i in range(len(points)):
        free[i] = cost_at(around, points[i, 0], points[i, 1]) < INSCRIBED
    return free


@kernel()
def obstacles(
    x: F32, y: F32, around: Costmap, weight: float, collision: float, preferring: bool, costs: F32
) -> int:  # fmt: skip
    """Charge the mean inflated cost, `preferring` only, and collisions; return how many trajectories do not collide."""
    steps, batch = x.shape
    rows, columns = around.cost.shape
    total, worst = np.zeros(batch, np.float32), np.zeros(batch, np.float32)
    for k in range(steps):
        for b in range(batch):
            column, row = (x[k, b] - around.corner_x) * around.per_m, (y[k, b] - around.corner_y) * around.per_m
            if 0.0 <= row < rows and 0.0 <= column < columns:
                here = around.cost[int(row), int(column)]
                total[b] += here
                worst[b] = max(worst[b], here)
    scale = weight / (254.0 * steps)
    free = 0
    for b in range(batch):
        if worst[b] >= INSCRIBED:
            costs[b] += scale * collision
        else:
            free += 1
            costs[b] += scale * total[b] if preferring else 0.0
    return free


@kernel(fast=True)
def constraints(controls: F32, lowest: F32, highest: F32, dt: float, weight: float, costs: F32) -> None:
    """Charge the way that is driven with more than the speed admitted: of both axes together for a base that can strafe."""
    _, steps, batch = controls.shape
    fastest = np.float32(np.hypot(highest[0], highest[1]))
    fastest_back = np.float32(np.hypot(lowest[0], lowest[1]))
    scale = np.float32(weight * dt)
    strafing = highest[1] > 0.0
    for k in range(steps):
        for b in range(batch):
            vx, vy = controls[0, k, b], controls[1, k, b]
            speed = np.sqrt(vx * vx + vy * vy) if strafing else abs(vx)
            costs[b] += scale * max(speed - (fastest if vx > 0.0 else fastest_back), np.float32(0.0))


@kernel(fast=True)
def backwards(controls: F32, dt: float, weight: float, costs: F32) -> None:
    """Charge the way driven in reverse."""
    _, steps, batch = controls.shape
    scale = np.float32(weight * dt)
    for k in range(steps):
        for b in range(batch):
            costs[b] += scale * max(-controls[0, k, b], np.float32(0.0))


@kernel(fast=True)
def twirling(controls: F32, weight: float, costs: F32) -> None:
    """Charge the mean rate of turning."""
    _, steps, batch = controls.shape
    scale = np.float32(weight / steps)
    for k in range(steps):
        for b in range(batch):
            costs[b] += scale * abs(controls[2, k, b])


@kernel(fast=True)
def goal_distance(x: F32, y: F32, goal_x: np.float32, goal_y: np.float32, weight: float, costs: F32) -> None:
    """Charge the mean distance to the goal."""
    steps, batch = x.shape
    scale = np.float32(weight / steps)
    for k in range(steps):
        for b in range(batch):
            dx, dy = x[k, b] - goal_x, y[k, b] - goal_y
            costs[b] += scale * np.sqrt(dx * dx + dy * dy)


@kernel()
def goal_angle(yaw: F32, goal_yaw: float, weight: float, costs: F32) -> None:
    """Charge the mean angle to the heading asked for at the goal."""
    steps, batch = yaw.shape
    for k in range(steps):
        for b in range(batch):
            costs[b] += weight / steps * abs((yaw[k, b] - goal_yaw + np.pi) % (2.0 * np.pi) - np.pi)


@kernel(fast=True)
def furthest_reached(x: F32, y: F32, path: F32) -> int:
    """Return the path's furthest point that is nearest to the end of some trajectory."""
    batch = x.shape[1]
    nearest, least = np.zeros(batch, np.int32), np.full(batch, np.inf, np.float32)
    for i in range(len(path)):
        for b in range(batch):
            dx, dy = x[-1, b] - path[i, 0], y[-1, b] - path[i, 1]
            squared = dx * dx + dy * dy
            if squared < least[b]:
                least[b], nearest[b] = squared, i
    return int(nearest.max())


@kernel(fast=True)
def path_distance(
    x: F32, y: F32, start_x: np.float32, start_y: np.float32, path: F32, open_: Mask, every: int, weight: float, costs: F32
) -> None:
    """Charge the mean distance to the path's point that is as far along it as the trajectory is long by then.

    The path's points lie equally far apart; those that are not `open_`, shape (n,), do not count.
    """
    steps, batch = x.shape
    last = len(path) - 1
    step_x, step_y = path[1, 0] - path[0, 0], path[1, 1] - path[0, 1]
    spacing = np.sqrt(step_x * step_x + step_y * step_y)
    per_m = np.float32(1.0) / max(spacing, np.float32(1e-6))
    driven, total = np.zeros(batch, np.float32), np.zeros(batch, np.float32)
    count = np.zeros(batch, np.float32)
    for k in range(every - 1, steps, every):
        for b in range(batch):
            before_x = x[k - every, b] if k >= every else start_x
            before_y = y[k - every, b] if k >= every else start_y
            dx, dy = x[k, b] - before_x, y[k, b] - before_y
            driven[b] += np.sqrt(dx * dx + dy * dy)
            i = min(int(driven[b] * per_m + np.float32(0.5)), last)
            if open_[i]:
                dx, dy = x[k, b] - path[i, 0], y[k, b] - path[i, 1]
                total[b] += np.sqrt(dx * dx + dy * dy)
                count[b] += np.float32(1.0)
    for b in range(batch):
        costs[b] += np.float32(weight) * total[b] / max(count[b], np.float32(1.0))


@kernel(fast=True)
def end_distance(x: F32, y: F32, to_x: np.float32, to_y: np.float32, weight: float, costs: F32) -> None:
    """Charge the distance from a trajectory's end to a point of the path."""
    for b in range(x.shape[1]):
        dx, dy = x[-1, b] - to_x, y[-1, b] - to_y
        costs[b] += np.float32(weight) * np.sqrt(dx * dx + dy * dy)


@kernel()
def end_angle(x: F32, y: F32, yaw: F32, to_x: np.float32, to_y: np.float32, weight: float, costs: F32) -> None:
    """Charge the angle at a trajectory's end between its heading and the bearing of a point of the path."""
    for b in range(x.shape[1]):
        off = np.arctan2(to_y - y[-1, b], to_x - x[-1, b]) - yaw[-1, b]
        costs[b] += weight * abs((off + np.pi) % (2.0 * np.pi) - np.pi)
