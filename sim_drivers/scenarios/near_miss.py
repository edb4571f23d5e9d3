"""Near miss: an open floor that others cross, some obliquely; nothing hides them, and there is room to give way.

Source: Han, Zhu, RCSP, section 5.1 and table 3, the moving obstacles before Nav2's controllers.  Geometry and schedule are ours.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal
from drivers.interface.seeds import stream
from sim_drivers.scenarios.corridor import corridor
from sim_drivers.scenarios.shuttles import Lane, ShuttleSettings, draw_shuttle
from sim_drivers.scene import Mover, Scene, Shape

LANES_X_M = (2.2, 4.2, 6.2)
GOAL_X_M = 8.4
BEHIND_M, BEYOND_M = 1.5, 1.5  # from start and goal to the walls
HEIGHT_M = 1.0
LANE_GAP_M = 0.1  # between who crosses and the wall


class NearMissSettings(ShuttleSettings):
    """Three lanes across a floor of 6 m."""

    half_width_m: float = Field(3.0, ge=2.0, le=6.0, description="from the middle to a wall")
    slant_m: float = Field(
        0.5, ge=0.0, le=0.6, description="how far a lane's ends may be drawn from its middle, along the robot's way"
    )
    walker_radius_m: float = Field(0.25, ge=0.1, le=0.4, description="radius of who crosses")
    goal_tolerance_m: float = Field(0.35, gt=0.0, le=1.0, description="how near the goal counts as reached")
    time_limit_s: float = Field(60.0, gt=0.0, le=600.0, description="when the run is given up")


class NearMiss:
    """An open floor whose straight way to the goal three discs cross to and fro."""

    Settings = NearMissSettings

    def __init__(self, settings: NearMissSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings, rng = self._settings, stream(seed, "near_miss")
        movers = tuple(self._crosser(rng, index, x) for index, x in enumerate(LANES_X_M))
        walls = corridor(settings.half_width_m, -BEHIND_M, GOAL_X_M + BEYOND_M)
        goal = Goal(GOAL_X_M, 0.0, tolerance_m=settings.goal_tolerance_m)
        return Scene("near_miss", SE2(), (goal,), settings.time_limit_s, walls, movers)

    def _crosser(self, rng: np.random.Generator, index: int, x_m: float) -> Mover:
        settings = self._settings
        y = settings.half_width_m - settings.walker_radius_m - LANE_GAP_M
        slant = float(rng.uniform(-settings.slant_m, settings.slant_m))
        lane = Lane((x_m - slant, -y), (x_m + slant, y))
        return draw_shuttle(rng, settings, f"walker_{index}", Shape.cylinder(settings.walker_radius_m, HEIGHT_M), lane)
