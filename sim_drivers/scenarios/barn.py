"""Worlds of BARN, the Benchmark for Autonomous Robot Navigation: static clutter for a robot of the Jackal class.

Source: Perille, Truong, Xiao, Stone, Benchmarking metric ground navigation, SSRR 2020; the challenge's rules: a run ends within
1 m of the goal or after 100 s.  The file format is that of our excerpt, `tests/data/barn`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal
from drivers.interface.settings import Settings
from sim_drivers.scenarios.world_file import chosen_world, read_json
from sim_drivers.scene import Scene, Shape, StaticObstacle

Metres = Annotated[float, Field(ge=-1e3, le=1e3)]
Place = tuple[Metres, Metres]


class BarnSettings(Settings):
    """Which world, and when it is reached."""

    path: Path = Field(description="a JSON file of worlds")
    world: int | None = Field(default=None, ge=0, description="its number in the file; none: there is only one")
    goal_tolerance_m: float = Field(default=1.0, gt=0.0, le=5.0, description="how near the goal counts as reached")
    time_limit_s: float = Field(default=100.0, gt=0.0, le=600.0, description="when the run is given up")


class BarnWorld(Settings):
    """One world as the file has it."""

    cylinders: tuple[Place, ...]
    reference_path: tuple[Place, ...]  # through the clutter, of the benchmark's own search


class BarnFile(Settings):
    """A file of worlds that share start, goal and cylinder."""

    cylinder_radius_m: float = Field(gt=0.0, le=10.0)
    cylinder_height_m: float = Field(gt=0.0, le=10.0)
    start: tuple[Metres, Metres, Annotated[float, Field(ge=-7.0, le=7.0)]]
    goal: Place
    worlds: dict[str, BarnWorld] = Field(min_length=1)


class Barn:
    """A world of the BARN benchmark, from a file: cylinders that stand close; every seed is the same."""

    Settings = BarnSettings

    def __init__(self, settings: BarnSettings) -> None:
        """Take the settings; the file is read when the scene is drawn."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene.

        Raises:
            ConfigurationError: the file cannot be read, or there is no such world in it.
        """
        settings = self._settings
        file = read_json(settings.path, BarnFile)
        world = chosen_world(settings.path, file.worlds, settings.world)
        shape = Shape.cylinder(file.cylinder_radius_m, file.cylinder_height_m)
        static = tuple(StaticObstacle(f"cylinder_{k}", shape, SE2(x, y)) for k, (x, y) in enumerate(world.cylinders))
        goal = Goal(*file.goal, tolerance_m=settings.goal_tolerance_m)
        return Scene("barn", SE2(*file.start), (goal,), settings.time_limit_s, static)
