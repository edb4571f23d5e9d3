"""What the robot is out to do."""

from dataclasses import dataclass

from drivers.interface.geometry import SE2


@dataclass(frozen=True, slots=True)
class Goal:
    """A place in the map to reach.  `yaw_rad` None: any heading will do."""

    x_m: float
    y_m: float
    yaw_rad: float | None = None
    tolerance_m: float = 0.35
    yaw_tolerance_rad: float = 0.2


@dataclass(frozen=True, slots=True)
class Mission:
    """The goals still ahead, in order; none: there is nothing to reach and the robot only observes."""

    map_from_start: SE2
    goals: tuple[Goal, ...]

    @property
    def goal(self) -> Goal | None:
        """The goal to go to now."""
        return self.goals[0] if self.goals else None
