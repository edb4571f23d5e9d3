"""Door: a partition across the corridor, with a door that opens and closes by itself."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from drivers.interface.seeds import stream
from sim_drivers.scenarios.corridor import (
    WALL_HEIGHT_M,
    WALL_THICKNESS_M,
    CorridorSettings,
    closed_corridor,
    corridor_scene,
    wall,
)
from sim_drivers.scene import Mover, Scene, Shape

LEAF_THICKNESS_M = 0.05
LEAF_GAP_M = 0.02  # between the partition's far face and the leaf
OVERLAP_M = 0.025  # of the closed leaf with the partition, at either side
SWING_FRAMES = 13  # a quarter turn in steps of 7.5 degrees: straight lines between them leave the arc by 1 mm


class DoorSettings(CorridorSettings):
    """A door-like dynamic obstacle is the paper's (appendix D.1); how it is built and moves is ours."""

    half_width_m: float = Field(1.6, ge=1.0, le=5.0, description="from the centre line to a wall")
    motion: Literal["sliding", "swinging"] = Field("sliding", description="swinging: away from the coming robot")
    door_x_m: float = Field(6.0, ge=3.0, le=90.0, description="where the partition stands")
    opening_m: float = Field(1.0, ge=0.4, le=3.0, description="width of the doorway, on the centre line")
    open_s: float = Field(6.0, ge=0.1, le=120.0, description="how long the door rests open")
    move_s: float = Field(4.0, ge=0.5, le=60.0, description="how long it takes to open or close")
    closed_s: float = Field(3.0, ge=0.1, le=120.0, description="how long it rests closed")

    @model_validator(mode="after")
    def _fits(self) -> DoorSettings:
        if self.half_width_m < 1.5 * self.leaf_m:
            raise ValueError(f"half_width_m must be at least {1.5 * self.leaf_m:.3f}, for the leaf to slide aside")
        if self.door_x_m > self.goal_x_m - 1.5:
            raise ValueError(f"door_x_m {self.door_x_m} is less than 1.5 m before the goal at {self.goal_x_m} m")
        return self

    @property
    def leaf_m(self) -> float:
        """Width of the leaf."""
        return self.opening_m + 2.0 * OVERLAP_M

    @property
    def period_s(self) -> float:
        """From one opening to the next."""
        return self.open_s + self.closed_s + 2.0 * self.move_s


class Door:
    """A corridor of 12 m with a door that opens and closes by itself; the seed draws when."""

    Settings = DoorSettings

    def __init__(self, settings: DoorSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings = self._settings
        half, x, y = 0.5 * settings.opening_m, settings.door_x_m, settings.half_width_m
        partition = (wall("partition_left", (x, half), (x, y)), wall("partition_right", (x, -y), (x, -half)))
        phase_s = float(stream(seed, "door").uniform(0.0, settings.period_s))
        leaf = Mover("door", Shape.box(settings.leaf_m, LEAF_THICKNESS_M, WALL_HEIGHT_M), self._keyframes(-phase_s), looped=True)
        return corridor_scene("door", settings, (*closed_corridor(settings), *partition), (leaf,))

    def _keyframes(self, start_s: float) -> NDArray[np.float64]:
        """Return one period from fully open to fully open, shape (n, 4); it begins before time zero, for the phase."""
        settings = self._settings
        opening = self._opening()  # (n, 3), from closed to open
        part = np.linspace(0.0, settings.move_s, len(opening))
        close_s, open_s = settings.open_s, settings.open_s + settings.move_s + settings.closed_s
        rests_open = np.array([[0.0, *opening[-1]]])
        closing = np.column_stack((close_s + part, opening[::-1]))
        keyframes = np.concatenate((rests_open, closing, np.column_stack((open_s + part, opening))))
        keyframes[:, 0] += start_s
        return keyframes

    def _opening(self) -> NDArray[np.float64]:
        """Return the leaf's poses from closed to open, shape (n, 3); its own x axis points away from the hinge."""
        settings = self._settings
        x = settings.door_x_m + 0.5 * WALL_THICKNESS_M + LEAF_GAP_M + 0.5 * LEAF_THICKNESS_M
        if settings.motion == "sliding":
            return np.array([[x, 0.0, -0.5 * math.pi], [x, settings.leaf_m, -0.5 * math.pi]])
        reach, yaw = 0.5 * settings.leaf_m, np.linspace(-0.5 * math.pi, 0.0, SWING_FRAMES)
        return np.column_stack((x + reach * np.cos(yaw), reach + reach * np.sin(yaw), yaw))
