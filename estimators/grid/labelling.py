"""What one frame of a range sensor says about the cells around it, whichever sensor it was."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import SE2
from drivers.interface.samples import Stamp, frozen_array
from drivers.interface.sensed import Sensed
from estimators.belief import U8, Lattice, Mask, OccupancyGrid
from estimators.grid.label_kernels import label_cells
from estimators.memory.rolling import lattice_around


@dataclass(frozen=True, slots=True)
class FrameLabels:
    """The labels of one frame on its own lattice, and where the sensor looked but is too near to see."""

    grid: OccupancyGrid
    blind: Mask  # (rows, columns)


class FrameSource(Protocol):
    """One kind of range sensor, as the grid memory wants it."""

    def warm_up(self) -> None:
        """Compile every kernel."""
        ...

    def stamp(self, sensed: Sensed) -> Stamp | None:
        """Return the stamp of the newest frame that came; None: none came."""
        ...

    def see(self, sensed: Sensed, odom_from_base: SE2) -> FrameLabels | None:
        """Return what that frame says, taken from the robot's pose at its capture; None: it cannot be used."""
        ...


def lattice_in_reach(x: float, y: float, range_max_m: float, cell_m: float) -> Lattice:
    """Return the square lattice around a sensor at (x, y) in odom that holds every point in its range."""
    side = 2 * (math.ceil(range_max_m / cell_m) + 1) + 1
    return lattice_around(x, y, cell_m, side, side)


def keep_large_components(mask: U8, cells_min: int) -> U8:
    """Return the mask, shape (rows, columns), without its 8-connected components of fewer than `cells_min` cells."""
    if cells_min <= 1:
        return mask
    _, component, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    large = stats[:, cv2.CC_STAT_AREA] >= cells_min
    large[0] = False  # the background
    return np.asarray(large[component], dtype=np.uint8)


def label_frame(
    lattice: Lattice, hits: NDArray[Any], free_ends: U8, camera: tuple[float, float], hits_min: int, cells_min: int
) -> OccupancyGrid:
    """Return the labelled grid from counted returns and the ends of unobstructed rays, each (rows, columns).

    `camera` is the sensor's x, y in cells from the lattice's corner.
    """
    occupied = keep_large_components((hits >= hits_min).astype(np.uint8), cells_min)
    label = np.empty(hits.shape, dtype=np.uint8)
    label_cells(occupied, hits, free_ends, int(camera[1]), int(camera[0]), label)
    return OccupancyGrid(lattice, frozen_array(label))
