"""Corridor crossing: two pedestrians change sides in front of the robot."""

from __future__ import annotations

import math

from pydantic import Field

from drivers.interface.seeds import stream
from sim_drivers.scenarios.corridor import corridor_scene
from sim_drivers.scenarios.walkers import WalkerSettings, crossing_over, draw_gaits, walked_corridor
from sim_drivers.scene import Scene


class CorridorCrossingSettings(WalkerSettings):
    """Two pedestrians are the paper's (section 6); where and at which angle they cross is ours."""

    half_width_m: float = Field(1.5, ge=0.8, le=5.0, description="from the centre line to a wall")
    walkers: int = Field(2, ge=1, le=8, description="how many cross, in turn from the left and from the right")
    crossing_x_m: float = Field(6.5, ge=3.0, le=90.0, description="where they cross the centre line, but for their offset")
    crossing_angle_deg: float = Field(45.0, ge=20.0, le=70.0, description="between their way and the centre line")


class CorridorCrossing:
    """A corridor of 12 m in which two walkers cross the robot's way obliquely, one from each side."""

    Settings = CorridorCrossingSettings

    def __init__(self, settings: CorridorCrossingSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings = self._settings
        gaits = draw_gaits(stream(seed, "corridor_crossing"), settings, settings.walkers)
        movers = crossing_over(settings, gaits, settings.crossing_x_m, math.radians(settings.crossing_angle_deg))
        return corridor_scene("corridor_crossing", settings, walked_corridor(settings, settings.walkers), movers)
