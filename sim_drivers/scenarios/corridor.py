"""Corridors along x: what every scenario of the clearance paper takes place in.

Source: Cui, Deng, Wang, Clearance Deformation, Not Object Tracking.  The paper's are: start (0.5, 0, 0), goal one metre before
the end, its tolerance (appendix C) and the time limit of 60 s (table 3).  It gives no widths; ours go with the half-width of
1 m of the cross-section that its planner looks at (appendix B), and leave a robot of 0.12 m room beside a walker.
"""

from __future__ import annotations

import math

from pydantic import Field

from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal
from drivers.interface.settings import Settings
from sim_drivers.scene import Mover, Scene, Shape, StaticObstacle

START = SE2(0.5, 0.0, 0.0)
WALL_THICKNESS_M = 0.1
WALL_HEIGHT_M = 2.0
END_M = 1.5  # between start or goal and the wall at that end, where nobody has to get past

Point = tuple[float, float]


class CorridorSettings(Settings):
    """What all corridors share."""

    length_m: float = Field(12.0, ge=6.0, le=100.0, description="corridor from x = 0; the goal lies 1 m before its end")
    half_width_m: float = Field(1.2, ge=0.6, le=5.0, description="from the centre line to a wall")
    goal_tolerance_m: float = Field(0.35, gt=0.0, le=2.0, description="how near the goal counts as reached")
    time_limit_s: float = Field(60.0, gt=0.0, le=600.0, description="when the run is given up")

    @property
    def goal_x_m(self) -> float:
        """Where the goal lies on the centre line."""
        return self.length_m - 1.0


def corridor_scene(
    name: str, settings: CorridorSettings, static: tuple[StaticObstacle, ...], movers: tuple[Mover, ...] = ()
) -> Scene:
    """Return a scene with the start and goal that all corridors have."""
    goal = Goal(settings.goal_x_m, 0.0, tolerance_m=settings.goal_tolerance_m)
    return Scene(name, START, (goal,), settings.time_limit_s, static, movers)


def wall(name: str, start: Point, end: Point, thickness_m: float = WALL_THICKNESS_M) -> StaticObstacle:
    """Return a wall whose centre line runs between two points [m] of the map."""
    (x0, y0), (x1, y1) = start, end
    shape = Shape.box(math.hypot(x1 - x0, y1 - y0), thickness_m, WALL_HEIGHT_M)
    return StaticObstacle(name, shape, SE2((x0 + x1) / 2, (y0 + y1) / 2, math.atan2(y1 - y0, x1 - x0)))


def corridor(half_width_m: float, from_x_m: float, to_x_m: float) -> tuple[StaticObstacle, ...]:
    """Return the four walls around a corridor; its inner faces lie at the given distances."""
    y = half_width_m + WALL_THICKNESS_M / 2
    x0, x1 = from_x_m - WALL_THICKNESS_M / 2, to_x_m + WALL_THICKNESS_M / 2
    return (
        wall("wall_left", (from_x_m, y), (to_x_m, y)),
        wall("wall_right", (from_x_m, -y), (to_x_m, -y)),
        wall("wall_near", (x0, -y), (x0, y)),
        wall("wall_far", (x1, -y), (x1, y)),
    )


def closed_corridor(settings: CorridorSettings) -> tuple[StaticObstacle, ...]:
    """Return the walls of a corridor that nobody enters or leaves."""
    return corridor(settings.half_width_m, START.x - END_M, settings.goal_x_m + END_M)
