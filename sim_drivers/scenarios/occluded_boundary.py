"""Occluded boundary: a walker comes along the wall, partly hidden behind what stands there, and walks around it."""

from __future__ import annotations

from pydantic import Field, model_validator

from drivers.interface.geometry import SE2
from drivers.interface.seeds import stream
from sim_drivers.scenarios.corridor import WALL_HEIGHT_M, Point, corridor_scene
from sim_drivers.scenarios.walkers import WALL_GAP_M, WalkerSettings, draw_gaits, oncoming_x, walk, walked_corridor, walker
from sim_drivers.scene import Scene, Shape, StaticObstacle


class OccludedBoundarySettings(WalkerSettings):
    """A walker partly hidden is the paper's (section 6); the occluder's place and size are ours."""

    lateral_m: float = Field(0.15, ge=0.0, le=1.0, description="largest sideways offset that is drawn, to either side")
    occluder_x_m: float = Field(6.5, ge=3.0, le=90.0, description="where the occluder stands, at the left wall")
    occluder_length_m: float = Field(0.6, ge=0.1, le=5.0, description="along the corridor")
    occluder_depth_m: float = Field(0.7, ge=0.1, le=5.0, description="from the wall into the corridor")

    @model_validator(mode="after")
    def _passable(self) -> OccludedBoundarySettings:
        if self.occluder_depth_m > self.half_width_m:
            raise ValueError(f"occluder_depth_m {self.occluder_depth_m} reaches past the centre line of the corridor")
        return self


class OccludedBoundary:
    """A corridor of 12 m in which a walker steps out from behind a cupboard, around it and on towards the robot."""

    Settings = OccludedBoundarySettings

    def __init__(self, settings: OccludedBoundarySettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings = self._settings
        (gait,) = draw_gaits(stream(seed, "occluded_boundary"), settings, 1)
        timed_way = walk(self._way(gait.lateral_m), gait.start_s, gait.speed_m_s)
        shape = Shape.box(settings.occluder_length_m, settings.occluder_depth_m, WALL_HEIGHT_M)
        place = SE2(settings.occluder_x_m, settings.half_width_m - 0.5 * settings.occluder_depth_m)
        static = (*walked_corridor(settings, 1), StaticObstacle("occluder", shape, place))
        return corridor_scene("occluded_boundary", settings, static, (walker(0, timed_way, settings.walker_radius_m),))

    def _way(self, lateral_m: float) -> list[Point]:
        """Return the way points [m]: along the wall, at 45 degrees out, past the occluder, at 45 degrees back."""
        settings = self._settings
        face, keep = settings.half_width_m - settings.occluder_depth_m, settings.walker_radius_m + WALL_GAP_M
        lane = min(face + settings.walker_radius_m + lateral_m, settings.wall_lane_m)
        out, aside = face - keep, 0.5 * settings.occluder_length_m + keep
        before, after = settings.occluder_x_m + aside, settings.occluder_x_m - aside
        x0, x1 = oncoming_x(settings, 0, 1)
        return [
            (x0, lane),
            (before + lane - out, lane),
            (before, out),
            (after, out),
            (after - (lane - out), lane),
            (x1, lane),
        ]
