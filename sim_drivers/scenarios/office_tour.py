"""Office tour: two rooms on either side of a corridor, a door, walkers; the goals lie behind corners and in the other room."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from pydantic import Field, model_validator

from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.scenarios.corridor import WALL_THICKNESS_M, Point, wall
from sim_drivers.scenarios.leaf import Leaf
from sim_drivers.scenarios.walkers import walk, walker
from sim_drivers.scene import Mover, Scene, Shape, StaticObstacle

LENGTH_M, HALF_WIDTH_M = 14.0, 1.2  # of the corridor, along x from 0, between the walls' faces
ROOM_M = 5.0, 4.0  # of either room, along x and y
HOME_X_M, OFFICE_X_M = 1.0, 8.0  # where the rooms begin
HOME_DOOR_X_M, OFFICE_DOOR_X_M = 3.5, 10.5  # the middle of the doorways
HOME = SE2(2.0, 4.0, -0.5 * math.pi)
PLAY_M = 0.15  # how far furniture is drawn to any side
TABLE_M, DESK_M, CABINET_M = (1.4, 0.8, 0.75), (1.6, 0.7, 0.75), (0.9, 0.5, 1.8)


class OfficeTourSettings(Settings):
    """All figures are ours; the doorways take a robot of 0.34 m with room to spare."""

    opening_m: float = Field(1.4, ge=0.6, le=1.6, description="width of the doorways")
    open_s: float = Field(20.0, ge=0.1, le=120.0, description="how long the office's door rests open")
    move_s: float = Field(3.0, ge=0.5, le=60.0, description="how long it takes to open or close")
    closed_s: float = Field(4.0, ge=0.1, le=120.0, description="how long it rests closed")
    min_speed_m_s: float = Field(0.4, gt=0.0, le=2.0, description="slowest walker that is drawn")
    max_speed_m_s: float = Field(0.8, gt=0.0, le=2.0, description="fastest walker that is drawn")
    lateral_m: float = Field(0.5, ge=0.0, le=0.8, description="largest offset of the corridor's walker from its middle")
    walker_radius_m: float = Field(0.25, ge=0.1, le=0.35, description="radius of a walker")
    goal_tolerance_m: float = Field(0.35, gt=0.0, le=2.0, description="how near a goal counts as reached")
    time_limit_s: float = Field(360.0, gt=0.0, le=3600.0, description="when the run is given up")

    @model_validator(mode="after")
    def _consistent(self) -> OfficeTourSettings:
        if self.min_speed_m_s > self.max_speed_m_s:
            raise ValueError(f"min_speed_m_s {self.min_speed_m_s} is more than max_speed_m_s {self.max_speed_m_s}")
        return self


class OfficeTour:
    """From one room along the corridor into the other, to the corridor's end, and home again."""

    Settings = OfficeTourSettings

    def __init__(self, settings: OfficeTourSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        s, rng = self._settings, stream(seed, "office_tour")
        places = ((9.2, -4.4), (13.0, 0.0), (HOME.x, HOME.y))
        goals = tuple(Goal(x, y, tolerance_m=s.goal_tolerance_m) for x, y in places)
        leaf = Leaf("sliding", s.opening_m, s.open_s, s.move_s, s.closed_s)
        into_office = SE2(OFFICE_DOOR_X_M, -HALF_WIDTH_M - 0.5 * WALL_THICKNESS_M, -0.5 * math.pi)
        door = leaf.mover("door", into_office, float(rng.uniform(0.0, leaf.period_s)))
        static = (*self._walls(), *_furniture(rng))
        return Scene("office_tour", HOME, goals, s.time_limit_s, static, (door, *self._walkers(rng)))

    def _walls(self) -> tuple[StaticObstacle, ...]:
        y, x0, x1 = HALF_WIDTH_M + 0.5 * WALL_THICKNESS_M, -0.5 * WALL_THICKNESS_M, LENGTH_M + 0.5 * WALL_THICKNESS_M
        half = 0.5 * self._settings.opening_m
        return (
            wall("corridor_west", (x0, -y), (x0, y)),
            wall("corridor_east", (x1, -y), (x1, y)),
            *_with_doorway("home", (x0, y), (x1, y), HOME_DOOR_X_M, half),
            *_with_doorway("office", (x0, -y), (x1, -y), OFFICE_DOOR_X_M, half),
            *_room("home", HOME_X_M, y, 1.0),
            *_room("office", OFFICE_X_M, -y, -1.0),
        )

    def _walkers(self, rng: np.random.Generator) -> tuple[Mover, ...]:
        """Return who walks up and down the corridor, and who does along the office's far wall, for ever."""
        s, lane = self._settings, float(rng.uniform(-1.0, 1.0)) * self._settings.lateral_m
        gap = s.walker_radius_m + 0.15
        ways: tuple[list[Point], ...] = (
            [(gap, lane), (LENGTH_M - gap, lane), (gap, lane)],
            [(OFFICE_X_M + ROOM_M[0] - gap - 0.1, y) for y in (-5.0 + gap, -3.0, -5.0 + gap)],
        )
        return tuple(_pacing(rng, index, way, s) for index, way in enumerate(ways))


def _pacing(rng: np.random.Generator, index: int, way: list[Point], s: OfficeTourSettings) -> Mover:
    """Return the walker who goes there and back for ever; where he is at the beginning is drawn."""
    speed = float(rng.uniform(s.min_speed_m_s, s.max_speed_m_s))
    timed = walk(way, 0.0, speed)
    timed[:, 0] -= float(rng.uniform(0.0, timed[-1, 0]))
    return replace(walker(index, timed, s.walker_radius_m), looped=True)


def _with_doorway(name: str, start: Point, end: Point, at_x_m: float, half_m: float) -> tuple[StaticObstacle, ...]:
    (x0, y), (x1, _) = start, end
    return wall(f"{name}_wall_west", (x0, y), (at_x_m - half_m, y)), wall(f"{name}_wall_east", (at_x_m + half_m, y), (x1, y))


def _room(name: str, x_m: float, y_m: float, side: float) -> tuple[StaticObstacle, ...]:
    """Return the three walls of a room that lies to one side of a corridor's wall at y."""
    x0, x1 = x_m - 0.5 * WALL_THICKNESS_M, x_m + ROOM_M[0] + 0.5 * WALL_THICKNESS_M
    far = y_m + side * (ROOM_M[1] + WALL_THICKNESS_M)
    return (
        wall(f"{name}_west", (x0, y_m), (x0, far)),
        wall(f"{name}_east", (x1, y_m), (x1, far)),
        wall(f"{name}_far", (x0, far), (x1, far)),
    )


def _furniture(rng: np.random.Generator) -> tuple[StaticObstacle, ...]:
    """Return a desk and a cabinet at home, a table in the office."""
    placed = (("desk", DESK_M, 4.9, 4.3), ("cabinet", CABINET_M, 1.7, 1.9), ("table", TABLE_M, 10.5, -3.8))
    moved = rng.uniform(-PLAY_M, PLAY_M, (len(placed), 2))
    return tuple(
        StaticObstacle(name, Shape.box(*size), SE2(x + float(dx), y + float(dy), 0.0))
        for (name, size, x, y), (dx, dy) in zip(placed, moved, strict=True)
    )
