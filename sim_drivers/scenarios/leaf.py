"""The leaf of a door that opens and closes by itself, for any doorway."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import SE2
from sim_drivers.scenarios.corridor import WALL_HEIGHT_M, WALL_THICKNESS_M
from sim_drivers.scene import Mover, Shape

LEAF_THICKNESS_M = 0.05
LEAF_GAP_M = 0.02  # between the partition's far face and the leaf
OVERLAP_M = 0.025  # of the closed leaf with the partition, at either side
SWING_FRAMES = 13  # a quarter turn in steps of 7.5 degrees: straight lines between them leave the arc by 1 mm

Motion = Literal["sliding", "swinging"]  # to the left of who goes through; away from him


@dataclass(frozen=True, slots=True)
class Leaf:
    """How a leaf moves.  A doorway's frame has its origin in the middle of the opening, x the way through, y along the wall."""

    motion: Motion
    opening_m: float  # width of the doorway
    open_s: float  # how long it rests open
    move_s: float  # how long it takes to open or close
    closed_s: float  # how long it rests closed

    @property
    def width_m(self) -> float:
        """Width of the leaf."""
        return self.opening_m + 2.0 * OVERLAP_M

    @property
    def period_s(self) -> float:
        """From one opening to the next."""
        return self.open_s + self.closed_s + 2.0 * self.move_s

    def mover(self, name: str, map_from_doorway: SE2, begun_s: float) -> Mover:
        """Return the leaf, which came to rest open `begun_s` ago, `begun_s` at least 0, and goes on for ever."""
        opening = [map_from_doorway @ pose for pose in self._opening()]
        poses = np.array([(pose.x, pose.y, pose.yaw) for pose in opening])  # (n, 3), from closed to open
        poses[:, 2] = np.unwrap(poses[:, 2])
        shape = Shape.box(self.width_m, LEAF_THICKNESS_M, WALL_HEIGHT_M)
        return Mover(name, shape, self._keyframes(poses, -begun_s), looped=True)

    def _keyframes(self, opening: NDArray[np.float64], start_s: float) -> NDArray[np.float64]:
        """Return one period from fully open to fully open, shape (n, 4); it begins before time zero, for the phase."""
        part = np.linspace(0.0, self.move_s, len(opening))
        close_s, open_s = self.open_s, self.open_s + self.move_s + self.closed_s
        rests_open = np.array([[0.0, *opening[-1]]])
        closing = np.column_stack((close_s + part, opening[::-1]))
        keyframes = np.concatenate((rests_open, closing, np.column_stack((open_s + part, opening))))
        keyframes[:, 0] += start_s
        return keyframes

    def _opening(self) -> list[SE2]:
        """Return the leaf's poses in the doorway from closed to open; its own x axis points away from the hinge."""
        x = 0.5 * WALL_THICKNESS_M + LEAF_GAP_M + 0.5 * LEAF_THICKNESS_M
        if self.motion == "sliding":
            return [SE2(x, 0.0, -0.5 * math.pi), SE2(x, self.width_m, -0.5 * math.pi)]
        reach = 0.5 * self.width_m
        yaws = np.linspace(-0.5 * math.pi, 0.0, SWING_FRAMES).tolist()
        return [SE2(x + reach * math.cos(yaw), reach + reach * math.sin(yaw), yaw) for yaw in yaws]
