"""A square to drive around on an open floor: how well a base follows, and how well its odometry knows.

Source of the test: Borenstein, Feng, UMBmark: a method for measuring, comparing and correcting dead-reckoning errors in mobile
robots, 1994 (a square of 4 m, driven in one sense and in the other).
"""

from __future__ import annotations

from pydantic import Field

from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal
from drivers.interface.settings import Settings
from sim_drivers.scenarios.corridor import wall
from sim_drivers.scene import Scene


class SquareSettings(Settings):
    """All figures are ours but for the side of 4 m."""

    side_m: float = Field(4.0, ge=0.5, le=50.0, description="side of the square")
    clockwise: bool = Field(False, description="the other sense")
    margin_m: float = Field(1.5, ge=0.5, le=20.0, description="from the square to the walls around the floor")
    goal_tolerance_m: float = Field(0.1, gt=0.0, le=1.0, description="how near a corner counts as reached")
    time_limit_s: float = Field(120.0, gt=0.0, le=3600.0, description="when the run is given up")


class Square:
    """An open floor with four corners to visit and come home; every seed is the same."""

    Settings = SquareSettings

    def __init__(self, settings: SquareSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        s = self._settings
        side = -s.side_m if s.clockwise else s.side_m
        corners = ((s.side_m, 0.0), (s.side_m, side), (0.0, side), (0.0, 0.0))
        goals = tuple(Goal(x, y, tolerance_m=s.goal_tolerance_m) for x, y in corners)
        low, high = -s.margin_m, s.side_m + s.margin_m
        bottom, top = min(0.0, side) - s.margin_m, max(0.0, side) + s.margin_m
        walls = (
            wall("wall_south", (low, bottom), (high, bottom)),
            wall("wall_east", (high, bottom), (high, top)),
            wall("wall_north", (high, top), (low, top)),
            wall("wall_west", (low, top), (low, bottom)),
        )
        return Scene("square", SE2(), goals, s.time_limit_s, walls)
