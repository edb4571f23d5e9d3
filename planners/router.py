"""The contract of a router: where the passage leads, on a larger scale than a planner looks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import wrap_angle
from drivers.interface.mission import Goal, Mission
from drivers.interface.settings import Settings
from drivers.interface.stateful import Stateful
from estimators.belief import Belief


@dataclass(frozen=True, slots=True)
class RouterSetup:
    """What the runtime hands to a router."""

    period_s: float
    robot_radius_m: float


@dataclass(frozen=True, slots=True)
class Route:
    """A way to the goal through what is known and not known to be blocked.

    Empty path: there is no goal, or no way (`blocked`).
    """

    goal_in_odom: tuple[float, float] | None
    path_in_odom: NDArray[np.float64]  # (n, 2), from the robot towards the goal
    length_m: float
    blocked: bool = False
    goal_yaw_in_odom: float | None = None  # heading to arrive with [rad]; None: any

    @property
    def empty(self) -> bool:
        """Whether there is nothing to follow."""
        return len(self.path_in_odom) == 0


def goal_yaw(belief: Belief, goal: Goal) -> float | None:
    """Return the heading [rad] in odom to arrive with; None: any will do."""
    return None if goal.yaw_rad is None else wrap_angle(goal.yaw_rad - belief.map_from_odom.yaw)


@runtime_checkable
class Router(Stateful, Protocol):
    """Finds a route.  Built as `Router(settings, setup)`."""

    Settings: ClassVar[type[Settings]]

    def warm_up(self) -> None:
        """Compile every kernel; called once before the first tick."""
        ...

    def route(self, belief: Belief, mission: Mission) -> Route:
        """Return the route to the mission's goal."""
        ...
