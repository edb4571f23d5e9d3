"""The contract of a planner: from a belief and a route to what each device is asked to do."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BaseLimits, BodyTwist, JointLimits, JointTrajectory
from drivers.interface.settings import Settings
from drivers.interface.stateful import Stateful
from estimators.belief import Belief
from planners.router import Route


def no_path() -> NDArray[np.float64]:
    """Return an empty path, shape (0, 2)."""
    return np.zeros((0, 2))


@dataclass(frozen=True, slots=True)
class PlannerSetup:
    """What the runtime hands to a planner."""

    period_s: float  # between two calls of `plan`
    robot_radius_m: float
    limits: BaseLimits | None  # None: a robot without a base
    seed: int
    arm_limits: JointLimits | None = None  # None: a robot without an arm
    kept_clear_m: float = 0.0  # what the shield keeps between the robot's centre and what stands; narrower ways are closed


@dataclass(frozen=True, slots=True)
class Diagnostics:
    """Base of what a planner or shield says about how it decided; every field is a number, a flag or a short text."""


@dataclass(frozen=True, slots=True)
class Drawing:
    """What a planner or shield shows of how it decided, for display only: lines through points, or the points themselves.

    Drawings of one name follow one another in the scene; one whose name is missing at a tick is wiped.
    """

    name: str
    points_in_odom: NDArray[np.float64]  # (n, 2)
    connected: bool = True  # a line through the points, else dots


@dataclass(frozen=True, slots=True)
class Plan:
    """What a planner asks for.  None for a device: it is asked nothing; the supervisor lets it rest."""

    base: BodyTwist | None
    arm: JointTrajectory | None = None
    path_in_odom: NDArray[np.float64] = field(default_factory=no_path)  # (n, 2), what it means to do; for display only
    diagnostics: Diagnostics = field(default_factory=Diagnostics)
    latency_ns: int = 0  # how long after the belief the command is meant to take effect
    drawings: tuple[Drawing, ...] = ()
    accomplished: bool | None = None  # of a mission that the planner itself holds; None: it holds none
    budget_ns: int = 0  # how long the planner had for it; the runtime fills it in, as replay needs what an `Anytime` was told


@runtime_checkable
class Planner(Stateful, Protocol):
    """Decides.  Built as `Planner(settings, setup)`; the constructor raises ConfigurationError for a base that cannot do
    what the planner needs.
    """

    Settings: ClassVar[type[Settings]]
    default_shield: ClassVar[str]  # the shield it is meant to run under, where the configuration names none

    def warm_up(self) -> None:
        """Compile every kernel; called once before the first tick."""
        ...

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return what to do now.  An empty route means: stand still; where it is blocked, turning to look is allowed."""
        ...


@runtime_checkable
class Anytime(Protocol):
    """A planner whose effort follows the time there is; it is asked this way, and `plan` is without a limit."""

    def plan_within(self, belief: Belief, route: Route, budget_ns: int) -> Plan:
        """Return what to do now, in `budget_ns` at most; the same arguments give the same plan, however fast the machine is."""
        ...
