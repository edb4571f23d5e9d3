"""The straight line to the goal: for planners that need no route, and to see what a router is worth."""

from __future__ import annotations

import math

import numpy as np

from drivers.interface.mission import Mission
from drivers.interface.settings import Settings
from estimators.belief import Belief
from planners.planner import no_path
from planners.polyline import resample
from planners.router import Route, RouterSetup, goal_yaw

_SPACING_M = 0.25


class StraightRouter:
    """Straight line: joins robot and goal, whatever lies between."""

    class Settings(Settings):
        """It has none."""

    def __init__(self, settings: Settings, setup: RouterSetup) -> None:
        """Take nothing."""

    def warm_up(self) -> None:
        """Nothing to compile."""

    def route(self, belief: Belief, mission: Mission) -> Route:
        """Return the segment from the robot to the goal, in odom."""
        if mission.goal is None:
            return Route(None, no_path(), 0.0)
        robot = belief.odom_from_base
        goal = belief.map_from_odom.inverse().apply(np.array([mission.goal.x_m, mission.goal.y_m]))
        ends = np.array([[robot.x, robot.y], goal])
        length_m, yaw = math.hypot(*(goal - ends[0])), goal_yaw(belief, mission.goal)
        return Route((float(goal[0]), float(goal[1])), resample(ends, _SPACING_M), length_m, goal_yaw_in_odom=yaw)

    def snapshot(self) -> bytes:
        """Return nothing: it has no state."""
        return b""

    def restore(self, snapshot: bytes) -> None:
        """Nothing to take over."""
