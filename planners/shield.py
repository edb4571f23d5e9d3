"""The contract of a shield: the last say on a command, over any planner, inside what the limits can reach now."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Protocol, runtime_checkable

from drivers.interface.commands import BaseLimits, BodyTwist, Command
from drivers.interface.settings import Settings
from drivers.interface.stateful import Stateful
from estimators.belief import Belief
from planners.planner import Diagnostics, Drawing


@dataclass(frozen=True, slots=True)
class ShieldSetup:
    """What the runtime hands to a shield."""

    period_s: float
    robot_radius_m: float
    limits: BaseLimits | None


@dataclass(frozen=True, slots=True)
class ReachableSet:
    """The twists that velocity, acceleration and jerk limits admit at this tick: a box, never empty."""

    lowest: BodyTwist
    highest: BodyTwist

    def clip(self, twist: BodyTwist) -> BodyTwist:
        """Return the nearest twist inside, axis by axis."""
        low, high = self.lowest, self.highest
        return BodyTwist(
            min(max(twist.vx, low.vx), high.vx),
            min(max(twist.vy, low.vy), high.vy),
            min(max(twist.wz, low.wz), high.wz),
        )


@dataclass(frozen=True, slots=True)
class Filtered:
    """What the shield made of a command."""

    command: Command
    intervened: bool = False  # it sends another twist than the nearest that can be reached to the one asked
    diagnostics: Diagnostics = field(default_factory=Diagnostics)
    drawings: tuple[Drawing, ...] = ()


@runtime_checkable
class Shield(Stateful, Protocol):
    """Filters commands.  Built as `Shield(settings, setup)`."""

    Settings: ClassVar[type[Settings]]

    @property
    def kept_clear_m(self) -> float:
        """What it keeps between the robot's centre and what stands still [m]; 0: it knows of no obstacle.

        A planner is told, so that it plans through no passage that the shield holds the robot before.
        """
        ...

    def warm_up(self) -> None:
        """Compile every kernel; called once before the first tick."""
        ...

    def filter(self, command: Command, belief: Belief, reachable: ReachableSet) -> Filtered:
        """Return the safest command near the asked one whose twist lies in `reachable`.

        Asked is what the planner wants in the end, reachable or not: who asks to stand brakes until he stands, and a forecast of
        it is not one of the speed that he has after this tick.
        """
        ...
