"""Worlds of DynaBARN: an open floor with discs that follow ways of their own, for a robot of the Jackal class.

Source: Nair, Jiang, Hou, Xu, Li, Xiao, Stone, DynaBARN: benchmarking metric ground navigation in dynamic environments, SSRR
2022.  The file format is that of our excerpt, `tests/data/dynabarn`: key frames between which we move in straight lines, where
the benchmark's simulator has a spline; at the end of its way a disc is at its beginning again.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.scenarios.world_file import chosen_world, read_json
from sim_drivers.scene import Mover, Scene, Shape

Metres = Annotated[float, Field(ge=-1e3, le=1e3)]
Seconds = Annotated[float, Field(ge=0.0, le=1e5)]
HEIGHT_M = 1.0


class DynaBarnSettings(Settings):
    """Which world, how long it has been moving, and when it is crossed."""

    path: Path = Field(description="a JSON file of worlds")
    world: int | None = Field(default=None, ge=0, description="its number in the file; none: there is only one")
    lead_s: float = Field(
        default=0.0, ge=0.0, le=600.0, description="the discs have been on their way for up to so long, drawn by the seed"
    )
    goal_tolerance_m: float = Field(default=0.25, gt=0.0, le=5.0, description="how near the goal counts as reached")
    time_limit_s: float = Field(default=100.0, gt=0.0, le=600.0, description="when the run is given up")


class Disc(Settings):
    """One disc and its way."""

    radius_m: float = Field(gt=0.0, le=10.0)
    period_s: float = Field(gt=0.0, le=1e5)
    keyframes_t_x_y: tuple[tuple[Seconds, Metres, Metres], ...] = Field(min_length=2)

    @model_validator(mode="after")
    def _in_time(self) -> Disc:
        times = [t for t, _, _ in self.keyframes_t_x_y]
        if any(later <= sooner for sooner, later in pairwise(times)):
            raise ValueError("keyframes_t_x_y must go on in time")
        if abs(times[-1] - times[0] - self.period_s) > 0.05:
            raise ValueError(f"keyframes_t_x_y last {times[-1] - times[0]:g} s, but period_s is {self.period_s:g}")
        return self


class DynaBarnFile(Settings):
    """A file of worlds that share start and goal."""

    start: tuple[Metres, Metres]
    goal: tuple[Metres, Metres]
    worlds: dict[str, tuple[Disc, ...]] = Field(min_length=1)


class DynaBarn:
    """A world of the DynaBARN benchmark, from a file: an open floor with discs on ways of their own."""

    Settings = DynaBarnSettings

    def __init__(self, settings: DynaBarnSettings) -> None:
        """Take the settings; the file is read when the scene is drawn."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene; the robot looks at its goal.

        Raises:
            ConfigurationError: the file cannot be read, or there is no such world in it.
        """
        settings = self._settings
        file = read_json(settings.path, DynaBarnFile)
        discs = chosen_world(settings.path, file.worlds, settings.world)
        lead_s = float(stream(seed, "dynabarn").uniform(0.0, settings.lead_s))
        movers = tuple(_mover(index, disc, lead_s) for index, disc in enumerate(discs))
        (x, y), (goal_x, goal_y) = file.start, file.goal
        start = SE2(x, y, float(np.arctan2(goal_y - y, goal_x - x)))
        goal = Goal(goal_x, goal_y, tolerance_m=settings.goal_tolerance_m)
        return Scene("dynabarn", start, (goal,), settings.time_limit_s, (), movers)


def _mover(index: int, disc: Disc, lead_s: float) -> Mover:
    keyframes = np.column_stack((np.array(disc.keyframes_t_x_y), np.zeros(len(disc.keyframes_t_x_y))))
    keyframes[:, 0] -= lead_s
    return Mover(f"disc_{index}", Shape.cylinder(disc.radius_m, HEIGHT_M), keyframes, looped=True)
