"""The dynamic hallway: one walker comes towards the robot; or several; or they wander."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from pydantic import Field

from drivers.interface.seeds import stream
from sim_drivers.scenarios.corridor import END_M, START, closed_corridor, corridor_scene
from sim_drivers.scenarios.walkers import (
    AWAY_M,
    WALL_GAP_M,
    WalkerSettings,
    bounce,
    draw_gaits,
    oncoming,
    walked_corridor,
    walker,
)
from sim_drivers.scene import Mover, Scene


class DynamicHallwaySettings(WalkerSettings):
    """One opposing walker (section 6); four opposing and four in random directions are the paper's figure 3."""

    walkers: int = Field(1, ge=1, le=8, description="how many")
    directions: Literal["opposing", "random"] = Field("opposing", description="random: they wander between the walls")


class DynamicHallway:
    """A corridor of 12 m with walkers who come towards the robot, or wander."""

    Settings = DynamicHallwaySettings

    def __init__(self, settings: DynamicHallwaySettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings, rng = self._settings, stream(seed, "dynamic_hallway")
        if settings.directions == "random":
            return corridor_scene("dynamic_hallway", settings, closed_corridor(settings), self._wandering(rng))
        gaits = draw_gaits(rng, settings, settings.walkers)
        return corridor_scene("dynamic_hallway", settings, walked_corridor(settings, settings.walkers), oncoming(settings, gaits))

    def _wandering(self, rng: np.random.Generator) -> tuple[Mover, ...]:
        """Return walkers who start spread over the corridor, away from the robot, and are reflected by the walls.

        They walk through one another, as they walk into the robot: nobody here gives way.
        """
        settings = self._settings
        keep = settings.walker_radius_m + WALL_GAP_M
        y = settings.half_width_m - keep
        room = np.array([[START.x - END_M + keep, -y], [settings.goal_x_m + END_M - keep, y]])
        bounds = np.linspace(START.x + AWAY_M, settings.goal_x_m, settings.walkers + 1)
        movers = []
        for index in range(settings.walkers):
            start = np.array([rng.uniform(bounds[index], bounds[index + 1]), rng.uniform(-y, y)])
            heading, speed = rng.uniform(-math.pi, math.pi), rng.uniform(settings.min_speed_m_s, settings.max_speed_m_s)
            way = bounce(start, heading, speed, room, settings.time_limit_s)
            movers.append(walker(index, way, settings.walker_radius_m))
        return tuple(movers)
