"""Passage selection: a centre wall splits the corridor, and one of the two channels is narrow or blocked."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from drivers.interface.geometry import SE2
from drivers.interface.seeds import stream
from sim_drivers.scenarios.corridor import (
    WALL_HEIGHT_M,
    WALL_THICKNESS_M,
    CorridorSettings,
    closed_corridor,
    corridor_scene,
    wall,
)
from sim_drivers.scene import Scene, Shape, StaticObstacle


class PassageSelectionSettings(CorridorSettings):
    """The centre wall and the two channels are the paper's (figure 3, appendix D.1); every length is ours."""

    length_m: float = Field(14.0, ge=12.0, le=100.0, description="corridor from x = 0; the goal lies 1 m before its end")
    half_width_m: float = Field(1.5, ge=0.8, le=5.0, description="from the centre line to a wall")
    split_x_m: float = Field(4.5, ge=2.0, le=50.0, description="where the centre wall begins")
    split_length_m: float = Field(5.0, ge=0.5, le=50.0, description="how long it is")
    worse_channel: Literal["open", "narrow", "blocked"] = Field("narrow", description="open: both channels are alike")
    worse_side: Literal["left", "right", "drawn"] = Field("drawn", description="left: the robot had better go right")
    narrow_width_m: float = Field(0.5, ge=0.1, le=3.0, description="what is left of a narrow channel")

    @model_validator(mode="after")
    def _consistent(self) -> PassageSelectionSettings:
        if self.split_x_m + self.split_length_m > self.goal_x_m - 1.0:
            raise ValueError(f"the centre wall ends less than 1 m before the goal at {self.goal_x_m} m")
        if self.narrow_width_m > self.channel_width_m:
            raise ValueError(f"narrow_width_m {self.narrow_width_m} is more than the channel's {self.channel_width_m:.2f} m")
        return self

    @property
    def channel_width_m(self) -> float:
        """Width of an open channel."""
        return self.half_width_m - WALL_THICKNESS_M / 2


class PassageSelection:
    """A corridor of 14 m, split by a centre wall into a wide channel and a narrow or blocked one."""

    Settings = PassageSelectionSettings

    def __init__(self, settings: PassageSelectionSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings = self._settings
        ends = settings.split_x_m, settings.split_x_m + settings.split_length_m
        static = (*closed_corridor(settings), wall("centre_wall", (ends[0], 0.0), (ends[1], 0.0)))
        if settings.worse_channel != "open":
            static = (*static, self._filling(self._side(seed)))
        return corridor_scene("passage_selection", settings, static)

    def _side(self, seed: int) -> float:
        if self._settings.worse_side == "drawn":
            return 1.0 if stream(seed, "passage_selection").random() < 0.5 else -1.0
        return 1.0 if self._settings.worse_side == "left" else -1.0

    def _filling(self, side: float) -> StaticObstacle:
        """Return what stands in the worse channel, along its outer wall: all of its length and width, but for the narrow rest."""
        settings = self._settings
        left = settings.narrow_width_m if settings.worse_channel == "narrow" else 0.0
        width = settings.channel_width_m - left
        shape = Shape.box(settings.split_length_m, width, WALL_HEIGHT_M)
        x = settings.split_x_m + 0.5 * settings.split_length_m
        return StaticObstacle("filling", shape, SE2(x, side * (settings.half_width_m - 0.5 * width)))
