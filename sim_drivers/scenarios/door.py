"""Door: a partition across the corridor, with a door that opens and closes by itself."""

from __future__ import annotations

from pydantic import Field, model_validator

from drivers.interface.geometry import SE2
from drivers.interface.seeds import stream
from sim_drivers.scenarios.corridor import CorridorSettings, closed_corridor, corridor_scene, wall
from sim_drivers.scenarios.leaf import Leaf, Motion
from sim_drivers.scene import Scene


class DoorSettings(CorridorSettings):
    """A door-like dynamic obstacle is the paper's (appendix D.1); how it is built and moves is ours."""

    half_width_m: float = Field(1.6, ge=1.0, le=5.0, description="from the centre line to a wall")
    motion: Motion = Field("sliding", description="swinging: away from the coming robot")
    door_x_m: float = Field(6.0, ge=3.0, le=90.0, description="where the partition stands")
    opening_m: float = Field(1.0, ge=0.4, le=3.0, description="width of the doorway, on the centre line")
    open_s: float = Field(6.0, ge=0.1, le=120.0, description="how long the door rests open")
    move_s: float = Field(4.0, ge=0.5, le=60.0, description="how long it takes to open or close")
    closed_s: float = Field(3.0, ge=0.1, le=120.0, description="how long it rests closed")

    @model_validator(mode="after")
    def _fits(self) -> DoorSettings:
        least_m = 1.5 * self.leaf.width_m
        if self.half_width_m < least_m:
            raise ValueError(f"half_width_m must be at least {least_m:.3f}, for the leaf to slide aside")
        if self.door_x_m > self.goal_x_m - 1.5:
            raise ValueError(f"door_x_m {self.door_x_m} is less than 1.5 m before the goal at {self.goal_x_m} m")
        return self

    @property
    def leaf(self) -> Leaf:
        """How the leaf moves."""
        return Leaf(self.motion, self.opening_m, self.open_s, self.move_s, self.closed_s)


class Door:
    """A corridor of 12 m with a door that opens and closes by itself; the seed draws when."""

    Settings = DoorSettings

    def __init__(self, settings: DoorSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings = self._settings
        half, x, y = 0.5 * settings.opening_m, settings.door_x_m, settings.half_width_m
        partition = (wall("partition_left", (x, half), (x, y)), wall("partition_right", (x, -y), (x, -half)))
        begun_s = float(stream(seed, "door").uniform(0.0, settings.leaf.period_s))
        leaf = settings.leaf.mover("door", SE2(x, 0.0, 0.0), begun_s)
        return corridor_scene("door", settings, (*closed_corridor(settings), *partition), (leaf,))
