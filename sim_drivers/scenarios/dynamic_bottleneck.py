"""Dynamic bottleneck: rows of posts with one opening each, and what crosses behind the openings.

Source: Han, Zhu, RCSP, section 5.1 and figure 1, the BARN/DynaBARN-style environment.  A robot in an opening is safe; one that
goes on has to be past the lane behind it before the lane closes.  Geometry and schedule are ours.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal
from drivers.interface.seeds import stream
from sim_drivers.scenarios.corridor import corridor
from sim_drivers.scenarios.shuttles import Lane, ShuttleSettings, draw_shuttle
from sim_drivers.scene import Mover, Scene, Shape, StaticObstacle

ROWS_X_M = (3.0, 4.8, 7.2)  # of posts
LANES = ((3.9, 0), (6.0, 1), (8.1, 2))  # x [m] of a lane, and the row whose opening it passes
BEHIND_M, BEYOND_M = 1.5, 1.5  # from start and goal to the walls
POST_RADIUS_M, POST_STEP_M, HEIGHT_M = 0.10, 0.40, 1.0  # light and sight go between two posts; the robot does not
LANE_GAP_M = 0.1  # between a shuttle and the wall


class DynamicBottleneckSettings(ShuttleSettings):
    """Three rows, three lanes."""

    half_width_m: float = Field(3.0, ge=2.0, le=6.0, description="from the middle to a wall")
    opening_m: float = Field(1.3, ge=0.9, le=2.5, description="between the posts on either side of an opening")
    lateral_m: float = Field(0.6, ge=0.0, le=1.0, description="largest sideways offset of an opening that is drawn")
    shuttle_radius_m: float = Field(0.30, ge=0.1, le=0.4, description="radius of what crosses")
    goal_x_m: float = Field(9.8, ge=9.4, le=30.0, description="the robot starts at x = 0")
    goal_tolerance_m: float = Field(0.35, gt=0.0, le=1.0, description="how near the goal counts as reached")
    time_limit_s: float = Field(60.0, gt=0.0, le=600.0, description="when the run is given up")


class DynamicBottleneck:
    """Three rows of posts with one opening each, behind which discs cross to and fro."""

    Settings = DynamicBottleneckSettings

    def __init__(self, settings: DynamicBottleneckSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings, rng = self._settings, stream(seed, "dynamic_bottleneck")
        openings = rng.uniform(-settings.lateral_m, settings.lateral_m, len(ROWS_X_M))
        posts = [post for row, y in enumerate(openings.tolist()) for post in self._row(row, y)]
        movers = tuple(self._shuttle(rng, index, float(openings[row]), x) for index, (x, row) in enumerate(LANES))
        walls = corridor(settings.half_width_m, -BEHIND_M, settings.goal_x_m + BEYOND_M)
        goal = Goal(settings.goal_x_m, 0.0, tolerance_m=settings.goal_tolerance_m)
        return Scene("dynamic_bottleneck", SE2(), (goal,), settings.time_limit_s, (*walls, *posts), movers)

    def _row(self, row: int, opening_y_m: float) -> list[StaticObstacle]:
        """Return the posts of a row, from either side of its opening out to the walls."""
        settings, shape = self._settings, Shape.cylinder(POST_RADIUS_M, HEIGHT_M)
        half, most = 0.5 * settings.opening_m + POST_RADIUS_M, settings.half_width_m - POST_RADIUS_M
        left = np.arange(opening_y_m + half, most, POST_STEP_M)
        right = np.arange(opening_y_m - half, -most, -POST_STEP_M)
        places = [*left.tolist(), *right.tolist()]
        return [StaticObstacle(f"post_{row}_{k}", shape, SE2(ROWS_X_M[row], y)) for k, y in enumerate(places)]

    def _shuttle(self, rng: np.random.Generator, index: int, opening_y_m: float, x_m: float) -> Mover:
        settings = self._settings
        y = settings.half_width_m - settings.shuttle_radius_m - LANE_GAP_M
        lane = Lane((x_m, -y), (x_m, y), crossing=0.5 * (opening_y_m + y) / y)
        shape = Shape.cylinder(settings.shuttle_radius_m, HEIGHT_M)
        return draw_shuttle(rng, settings, f"shuttle_{index}", shape, lane)
