"""Worlds of DynaBARN: a floor with three walls and discs that follow ways of their own, for a robot of the Jackal class.

Source: Nair, Jiang, Hou, Xu, Li, Xiao, Stone, DynaBARN: benchmarking metric ground navigation in dynamic environments, SSRR
2022, and its world files: walls of 20 m at x = -10 m and y = -10 and 10 m, and a plugin per disc that gives Gazebo's
PoseAnimation its key frames.  Between these PoseAnimation follows a cubic Hermite spline, evenly in time from one key frame to
the next (gazebo-classic, common/Animation.cc); the tangents are those of Catmull and Rom (ignition-math, Spline.cc).  At the
end of its way a disc is at its beginning again.  The file format is that of our excerpt, `tests/data/dynabarn`.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.scenarios.world_file import chosen_world, read_json
from sim_drivers.scene import Mover, Scene, Shape, StaticObstacle

Metres = Annotated[float, Field(ge=-1e3, le=1e3)]
F64 = NDArray[np.float64]
Seconds = Annotated[float, Field(ge=0.0, le=1e5)]
HEIGHT_M = 1.0
SPACING_S = 0.1  # at most, of the points that a spline is driven through in straight lines
WALL_M = 0.5  # thick


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
    """A world of the DynaBARN benchmark, from a file: a floor with three walls and discs on ways of their own."""

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
        return Scene("dynabarn", start, (goal,), settings.time_limit_s, _walls(), movers)


def _walls() -> tuple[StaticObstacle, ...]:
    """Return the walls at the far end and at both sides, as every world of the benchmark has them."""
    along, across = Shape.box(20.0, WALL_M, HEIGHT_M), Shape.box(WALL_M, 20.0, HEIGHT_M)
    return (
        StaticObstacle("back_wall", across, SE2(-10.0, 0.0, 0.0)),
        StaticObstacle("top_wall", along, SE2(0.0, 10.0, 0.0)),
        StaticObstacle("bottom_wall", along, SE2(0.0, -10.0, 0.0)),
    )


def _mover(index: int, disc: Disc, lead_s: float) -> Mover:
    way = spline(np.array(disc.keyframes_t_x_y))
    keyframes = np.column_stack((way, np.zeros(len(way))))
    keyframes[:, 0] -= lead_s
    return Mover(f"disc_{index}", Shape.cylinder(disc.radius_m, HEIGHT_M), keyframes, looped=True)


def spline(keyframes: F64) -> F64:
    """Return points of the spline through key frames (t, x, y), shape (n, 3), `SPACING_S` apart at most, shape (m, 3).

    The tangent at a key frame is half of what lies between its neighbours, at an end half of what lies to the only one; the
    benchmark's ways are open.
    """
    times, points = keyframes[:, 0], keyframes[:, 1:]
    tangents = np.empty_like(points)
    tangents[1:-1] = 0.5 * (points[2:] - points[:-2])
    tangents[0], tangents[-1] = 0.5 * (points[1] - points[0]), 0.5 * (points[-1] - points[-2])
    pieces = [keyframes[:1]]
    for i, lasts_s in enumerate(np.diff(times)):
        share = np.linspace(0.0, 1.0, int(np.ceil(lasts_s / SPACING_S)) + 1)[1:, None]
        square, cube = share**2, share**3
        place = (
            (2.0 * cube - 3.0 * square + 1.0) * points[i]
            + (cube - 2.0 * square + share) * tangents[i]
            + (3.0 * square - 2.0 * cube) * points[i + 1]
            + (cube - square) * tangents[i + 1]
        )
        pieces.append(np.column_stack((times[i] + share * lasts_s, place)))
    return np.concatenate(pieces)
