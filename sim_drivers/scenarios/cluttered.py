"""Cluttered: five occluders to weave around, and one walker who crosses between them."""

from __future__ import annotations

import math

from pydantic import Field

from drivers.interface.geometry import SE2
from drivers.interface.seeds import stream
from sim_drivers.scenarios.corridor import WALL_HEIGHT_M, corridor_scene
from sim_drivers.scenarios.walkers import WalkerSettings, crossing_over, draw_gaits, walked_corridor
from sim_drivers.scene import Scene, Shape, StaticObstacle

# Places (x [m], side) and shapes.  Those at the walls' sides leave 0.4 m to the centre line and a lane along the wall.
CROSSING_X_M = 7.0
OFFSET_M = 0.65  # from the centre line to an occluder's centre
BOX, PILLAR = Shape.box(0.5, 0.5, WALL_HEIGHT_M), Shape.cylinder(0.25, WALL_HEIGHT_M)
OCCLUDERS = ((3.0, 1.0, BOX), (4.8, -1.0, PILLAR), (9.2, 1.0, PILLAR), (11.0, -1.0, BOX), (12.4, 1.0, BOX))


class ClutteredSettings(WalkerSettings):
    """Five occluders and one crossing walker are the paper's (section 6); where they stand and how he crosses is ours."""

    length_m: float = Field(15.0, ge=15.0, le=100.0, description="corridor from x = 0; the goal lies 1 m before its end")
    half_width_m: float = Field(1.6, ge=1.5, le=5.0, description="from the centre line to a wall")
    lateral_m: float = Field(0.2, ge=0.0, le=0.3, description="largest sideways offset that is drawn, to either side")
    crossing_angle_deg: float = Field(45.0, ge=45.0, le=70.0, description="between the walker's way and the centre line")


class Cluttered:
    """A corridor of 15 m with five occluders, alternating between the sides, and one walker who crosses between them."""

    Settings = ClutteredSettings

    def __init__(self, settings: ClutteredSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings = self._settings
        gaits = draw_gaits(stream(seed, "cluttered"), settings, 1)
        movers = crossing_over(settings, gaits, CROSSING_X_M, math.radians(settings.crossing_angle_deg))
        occluders = tuple(
            StaticObstacle(f"occluder_{index}", shape, SE2(x, side * OFFSET_M))
            for index, (x, side, shape) in enumerate(OCCLUDERS)
        )
        return corridor_scene("cluttered", settings, (*walked_corridor(settings, 1), *occluders), movers)
