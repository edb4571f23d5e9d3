"""Field-of-view limited: out of a side passage comes a walker whom no forward-looking camera sees in time."""

from __future__ import annotations

from pydantic import Field, model_validator

from drivers.interface.seeds import stream
from sim_drivers.scenarios.corridor import END_M, START, WALL_THICKNESS_M, corridor_scene, wall
from sim_drivers.scenarios.walkers import WalkerSettings, walk, walker
from sim_drivers.scene import Scene, StaticObstacle

PASSAGE_M = 4.0  # how deep the side passages are
REST_M = 3.0  # how far from the corridor, inside them, the walker waits and rests


class FovLimitedSettings(WalkerSettings):
    """A blind corner is the paper's (section 6; every planner collides there in all of its runs); the geometry is ours.

    A walker does not react, so where they meet follows from when.  The passage lies close to the start, where little time has
    passed to be early or late in: whoever starts within 0.4 s and drives 0.35 to 0.5 m/s (the paper's cap) straight on is
    hit from the side.  The walker comes faster than the robot goes, so he enters a field of view of 87 degrees in the last
    moment, if at all; one of 120 degrees gets a glimpse of him in the passage.
    """

    length_m: float = Field(8.0, ge=6.0, le=100.0, description="corridor from x = 0; the goal lies 1 m before its end")
    half_width_m: float = Field(1.0, ge=0.6, le=2.0, description="from the centre line to a wall")
    min_speed_m_s: float = Field(1.15, gt=0.0, le=2.0, description="slowest walker that is drawn")
    max_delay_s: float = Field(0.2, ge=0.0, le=60.0, description="longest delay that is drawn")
    lateral_m: float = Field(0.1, ge=0.0, le=1.0, description="largest sideways offset that is drawn, to either side")
    passage_x_m: float = Field(1.5, ge=1.5, le=90.0, description="where the side passages open, on both sides")
    passage_width_m: float = Field(0.8, ge=0.4, le=3.0, description="how wide they are")
    meet_s: float = Field(2.7, ge=0.5, le=60.0, description="when the walker crosses the centre line, but for his delay")

    @model_validator(mode="after")
    def _fits(self) -> FovLimitedSettings:
        if self.lateral_m + self.walker_radius_m > 0.5 * self.passage_width_m:
            raise ValueError(f"passage_width_m {self.passage_width_m} is too narrow for the walker and his offset")
        if self.passage_x_m + 0.5 * self.passage_width_m > self.goal_x_m:
            raise ValueError(f"passage_x_m {self.passage_x_m} is not before the goal at {self.goal_x_m} m")
        return self


class FovLimited:
    """A corridor of 8 m with a blind corner: a walker comes out of a side passage just where the robot gets to."""

    Settings = FovLimitedSettings

    def __init__(self, settings: FovLimitedSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings, rng = self._settings, stream(seed, "fov_limited")
        speed = float(rng.uniform(settings.min_speed_m_s, settings.max_speed_m_s))
        meet_s = settings.meet_s + float(rng.uniform(0.0, settings.max_delay_s))
        x = settings.passage_x_m + float(rng.uniform(-settings.lateral_m, settings.lateral_m))
        y = settings.half_width_m + REST_M
        timed_way = walk([(x, -y), (x, y)], meet_s - y / speed, speed)
        movers = (walker(0, timed_way, settings.walker_radius_m),)
        return corridor_scene("fov_limited", settings, self._walls(), movers)

    def _walls(self) -> tuple[StaticObstacle, ...]:
        """Return the corridor's walls with the passages' openings, and the passages' own walls."""
        settings, half = self._settings, 0.5 * WALL_THICKNESS_M
        near, far = START.x - END_M, settings.goal_x_m + END_M
        low, high = (settings.passage_x_m + side * 0.5 * settings.passage_width_m for side in (-1.0, 1.0))
        walls = []
        for name, side in (("left", 1.0), ("right", -1.0)):
            y = side * (settings.half_width_m + half)
            end = side * (settings.half_width_m + PASSAGE_M)
            walls += [
                wall(f"wall_{name}_near", (near, y), (low, y)),
                wall(f"wall_{name}_far", (high, y), (far, y)),
                wall(f"passage_{name}_near", (low - half, y), (low - half, end)),
                wall(f"passage_{name}_far", (high + half, y), (high + half, end)),
                wall(f"passage_{name}_end", (low - 2 * half, end + side * half), (high + 2 * half, end + side * half)),
            ]
        y = settings.half_width_m + WALL_THICKNESS_M
        walls += [wall("wall_near", (near - half, -y), (near - half, y)), wall("wall_far", (far + half, -y), (far + half, y))]
        return tuple(walls)
