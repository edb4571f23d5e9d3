"""Which critics have a say at a tick, and with which point of the path.

Source: nav2_mppi_controller, the conditions under which each critic scores.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import wrap_angle
from estimators.belief import Belief
from planners.mppi import critic_kernels as critics
from planners.mppi.critic_kernels import Costmap
from planners.mppi.optimizer import Optimizer
from planners.mppi.settings import MppiSettings
from planners.path_following import Task

F32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Scored:
    """What came of it."""

    free: int  # trajectories that do not collide
    furthest_m: float  # along the path, that any trajectory reaches


class Scorer:
    """Adds up the critics' charges."""

    def __init__(self, settings: MppiSettings) -> None:
        """Take the weights and thresholds."""
        self._settings = settings
        self._cost = np.zeros((0, 0), np.float32)

    def warm_up(self, batch: Optimizer, field: F32) -> None:
        """Compile every critic, those too that seldom have a say; `field` is of a belief's type, shape (rows, columns)."""
        costs, x, y, path = batch.costs, batch.x, batch.y, np.zeros((2, 2), np.float32)
        cost, zero = np.zeros(field.shape, np.float32), np.float32(0.0)
        around = Costmap(cost, zero, zero, np.float32(1.0))
        critics.inflate(field, 0.5, 1.0, 1.0, cost)
        critics.constraints(batch.controls, batch.lowest, batch.highest, 0.1, 1.0, costs)
        critics.obstacles(x, y, around, 1.0, 1.0, True, costs)
        critics.goal_distance(x, y, zero, zero, 1.0, costs)
        critics.goal_angle(batch.yaw, 0.0, 1.0, costs)
        critics.backwards(batch.controls, 0.1, 1.0, costs)
        critics.twirling(batch.controls, 1.0, costs)
        critics.furthest_reached(x, y, path)
        critics.path_distance(x, y, zero, zero, path, critics.collision_free(around, path), 1, 1.0, costs)
        critics.end_distance(x, y, zero, zero, 1.0, costs)
        critics.end_angle(x, y, batch.yaw, zero, zero, 1.0, costs)

    def costmap(self, belief: Belief, task: Task) -> Costmap:
        """Return the inflated costs around the robot, valid until the next call; its own cell never counts as a collision."""
        s, field, lattice = self._settings, belief.clearance.clearance_m, belief.clearance.lattice
        if self._cost.shape != field.shape:
            self._cost = np.empty(field.shape, np.float32)
        (row,), (column,) = lattice.cell_of(task.pose[None, :2])
        inside = 0 <= row < lattice.rows and 0 <= column < lattice.columns
        required_m = min(task.required_m, float(field[row, column])) if inside else task.required_m
        critics.inflate(field, required_m, s.inflation_radius_m, s.inflation_scaling_per_m, self._cost)
        return Costmap(self._cost, np.float32(lattice.x_m), np.float32(lattice.y_m), np.float32(1.0 / lattice.cell_m))

    def score(self, batch: Optimizer, task: Task, around: Costmap) -> Scored:
        """Add what each critic charges to `batch.costs`."""
        s, costs = self._settings, batch.costs
        critics.constraints(batch.controls, batch.lowest, batch.highest, s.model_dt_s, s.constraint_weight, costs)
        preferring = task.distance_m > s.near_goal_m
        free = critics.obstacles(batch.x, batch.y, around, s.cost_weight, s.collision_cost, preferring, costs)
        if task.distance_m < s.goal_threshold_m:
            goal = np.float32(task.goal[0]), np.float32(task.goal[1])
            critics.goal_distance(batch.x, batch.y, *goal, s.goal_weight, costs)
        if task.turn_rad is not None and task.distance_m < s.goal_angle_threshold_m:
            critics.goal_angle(batch.yaw, float(task.pose[2] + task.turn_rad), s.goal_angle_weight, costs)
        if task.distance_m > s.prefer_forward_threshold_m:
            critics.backwards(batch.controls, s.model_dt_s, s.prefer_forward_weight, costs)
        if s.twirling_weight > 0.0 and batch.highest[1] > 0.0:
            critics.twirling(batch.controls, s.twirling_weight, costs)
        return Scored(free, self._follow(batch, task, around))

    def _follow(self, batch: Optimizer, task: Task, around: Costmap) -> float:
        """Let the path's critics charge; return how far along the path any trajectory reaches [m]."""
        s, costs, path = self._settings, batch.costs, task.path.astype(np.float32)
        length_m = math.hypot(*(task.path[1] - task.path[0])) * (len(path) - 1)
        furthest = critics.furthest_reached(batch.x, batch.y, path)
        open_ = critics.collision_free(around, path)
        if length_m > s.path_align_threshold_m and furthest >= s.path_align_offset and not self._occupied(open_):
            start = np.float32(task.pose[0]), np.float32(task.pose[1])
            every = min(s.path_align_step, s.time_steps)
            critics.path_distance(batch.x, batch.y, *start, path, open_, every, s.path_align_weight, costs)
        if task.left_m > s.path_follow_threshold_m:
            point = path[_first_open(open_, furthest + s.path_follow_offset)]
            critics.end_distance(batch.x, batch.y, point[0], point[1], s.path_follow_weight, costs)
        point = path[min(furthest + s.path_angle_offset, len(path) - 1)]
        aside_rad = wrap_angle(math.atan2(point[1] - task.pose[1], point[0] - task.pose[0]) - task.pose[2])
        if task.distance_m > s.path_angle_threshold_m and abs(aside_rad) > s.path_angle_limit_rad:
            critics.end_angle(batch.x, batch.y, batch.yaw, point[0], point[1], s.path_angle_weight, costs)
        return float(furthest) * length_m / (len(path) - 1)

    def _occupied(self, open_: critics.Mask) -> bool:
        """Whether so much of the path is blocked that the robot had better leave it."""
        blocked = int(np.count_nonzero(~open_))
        return blocked > 2 and blocked > self._settings.path_occupancy_ratio * len(open_)


def _first_open(open_: critics.Mask, index: int) -> int:
    """Return the first open point from this one on, or the last point: what moves is driven past, not through."""
    index = min(index, len(open_) - 1)
    further = np.flatnonzero(open_[index:])
    return index + int(further[0]) if len(further) else len(open_) - 1
