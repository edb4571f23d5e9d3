"""Hidden crossing: two walkers cross right before a robot that stands, so that the nearer one hides the other for a while.

A test of who is who, not of driving: the hardest moment for a tracker is the one after two obstacles were one surface.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.scenarios.corridor import START, corridor
from sim_drivers.scenarios.walkers import walk, walker
from sim_drivers.scene import Mover, Scene

HALF_WIDTH_M = 3.0
BEHIND_M, BEYOND_M = 1.0, 3.2  # from the start to the walls behind and ahead
REACH_M = 2.2  # how far to either side of the line of sight they walk


class HiddenCrossingSettings(Settings):
    """All figures are ours; the default distances lie well inside the paper's sensing range of 2.5 m."""

    near_m: float = Field(1.2, ge=0.8, le=2.0, description="least distance from the robot to where the nearer one crosses")
    gap_m: float = Field(0.55, ge=0.0, le=2.0, description="least distance between the places where the two cross")
    play_m: float = Field(0.2, ge=0.0, le=1.0, description="how much farther either distance may be drawn")
    min_speed_m_s: float = Field(0.5, gt=0.0, le=2.0, description="slowest walker that is drawn")
    max_speed_m_s: float = Field(1.25, gt=0.0, le=2.0, description="fastest walker that is drawn")
    slant_deg: float = Field(20.0, ge=0.0, le=60.0, description="largest angle that a way may differ from square by")
    meet_s: float = Field(4.0, ge=2.0, le=60.0, description="when both cross the line of sight")
    walker_radius_m: float = Field(0.25, ge=0.1, le=0.35, description="radius of a walker")
    time_limit_s: float = Field(8.0, gt=0.0, le=600.0, description="when the run is over")


class HiddenCrossing:
    """A robot that only watches; before it two walkers cross in opposite senses, one behind the other."""

    Settings = HiddenCrossingSettings

    def __init__(self, settings: HiddenCrossingSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings, rng = self._settings, stream(seed, "hidden_crossing")
        near_m = settings.near_m + float(rng.uniform(0.0, settings.play_m))
        far_m = near_m + settings.gap_m + float(rng.uniform(0.0, settings.play_m))
        slant = math.radians(settings.slant_deg) * float(rng.uniform(-1.0, 1.0))  # of both, or their ways would meet
        movers = tuple(
            self._crossing(rng, index, START.x + ahead_m, slant, sense)
            for index, ahead_m, sense in ((0, near_m, 1), (1, far_m, -1))
        )
        walls = corridor(HALF_WIDTH_M, START.x - BEHIND_M, START.x + BEYOND_M)
        return Scene("hidden_crossing", START, (), settings.time_limit_s, walls, movers)

    def _crossing(self, rng: np.random.Generator, index: int, x_m: float, slant: float, sense: int) -> Mover:
        """Return the walker who crosses the line of sight at x in the middle of his way."""
        settings = self._settings
        speed = float(rng.uniform(settings.min_speed_m_s, settings.max_speed_m_s))
        run_m, y_m = REACH_M * math.tan(slant), sense * REACH_M
        begin_s = settings.meet_s - math.hypot(run_m, REACH_M) / speed
        way = walk([(x_m - sense * run_m, -y_m), (x_m + sense * run_m, y_m)], begin_s, speed)
        return walker(index, way, settings.walker_radius_m)
