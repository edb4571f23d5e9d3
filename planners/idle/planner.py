"""The planner of a robot that only observes: a recording, a bench test, an arm that someone else moves."""

from typing import ClassVar

from drivers.interface.settings import Settings
from drivers.interface.stateful import pack
from estimators.belief import Belief
from planners.idle.settings import IdleSettings
from planners.planner import Plan, PlannerSetup
from planners.router import Route


class Idle:
    """Asks for nothing; the robot stands and observes."""

    Settings: ClassVar[type[Settings]] = IdleSettings
    default_shield: ClassVar[str] = "none"

    def __init__(self, settings: IdleSettings, setup: PlannerSetup) -> None:
        """Take any robot."""

    def warm_up(self) -> None:
        """There is nothing to compile."""

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return a plan without a request; the route is shown as it is."""
        return Plan(base=None, path_in_odom=route.path_in_odom)

    def snapshot(self) -> bytes:
        """Return the empty state."""
        return pack()

    def restore(self, snapshot: bytes) -> None:
        """There is nothing to take over."""
