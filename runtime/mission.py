"""The mission as it stands: goals are reached one after the other, and the operator may send the robot somewhere else."""

from __future__ import annotations

from drivers.interface.geometry import wrap_angle
from drivers.interface.mission import Goal, Mission
from drivers.interface.samples import NewGoal, OperatorEvent
from estimators.belief import Belief


class MissionTracker:
    """Holds the mission; `sensed` carries what it holds, so a replay sees the same."""

    def __init__(self, mission: Mission) -> None:
        """Start with the configured mission."""
        self.mission = mission

    def fold(self, events: tuple[OperatorEvent, ...]) -> Mission:
        """Take new goals from the operator (the last one replaces all that are left) and return the mission."""
        for event in events:
            if isinstance(event.action, NewGoal):
                self.mission = Mission(self.mission.map_from_start, (event.action.goal,))
        return self.mission

    def advance(self, belief: Belief) -> bool:
        """Drop the present goal when the robot believes it is there; return whether that was the last one."""
        goal = self.mission.goal
        if goal is None or not is_at(goal, belief):
            return False
        self.mission = Mission(self.mission.map_from_start, self.mission.goals[1:])
        return self.mission.goal is None


def is_at(goal: Goal, belief: Belief) -> bool:
    """Whether the robot believes that it stands within the goal's tolerances."""
    pose = belief.map_from_base
    near = (pose.x - goal.x_m) ** 2 + (pose.y - goal.y_m) ** 2 <= goal.tolerance_m**2
    turned = goal.yaw_rad is None or abs(wrap_angle(pose.yaw - goal.yaw_rad)) <= goal.yaw_tolerance_rad
    return near and turned
