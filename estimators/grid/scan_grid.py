"""From a planar range scan to the same labels as from depth, for robots and evaluations with a scanner."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.geometry import SE2
from drivers.interface.kernel import kernel
from drivers.interface.samples import RangeScan, Stamp, frozen_array
from drivers.interface.sensed import Sensed
from drivers.interface.settings import Settings
from estimators.belief import F64, U8
from estimators.grid.labelling import FrameLabels, label_frame, lattice_in_reach


class ScanGridSettings(Settings):
    """How ranges become cells."""

    range_min_m: float = Field(default=0.05, gt=0.0, le=2.0, description="ranges below are not trusted")
    range_max_m: float = Field(default=2.5, gt=0.2, le=40.0, description="how far from the scanner cells are labelled")
    hits_min: int = Field(default=1, ge=1, le=1000, description="returns that make a cell occupied")
    component_cells_min: int = Field(default=1, ge=1, le=100, description="smaller groups of occupied cells are noise")


@kernel()
def _collect_scan(
    range_cells: F64,  # (beams,)
    first_rad: float,  # in odom
    step_rad: float,
    scanner: tuple[float, float],  # x, y in cells from the lattice's corner
    limits_cells: tuple[float, float],
    hits: NDArray[Any],  # (rows, columns) int32, counted up
    free_ends: U8,  # (rows, columns)
) -> None:
    for beam in range(len(range_cells)):
        reach = range_cells[beam]
        if not reach >= limits_cells[0]:  # invalid (NaN) or too near
            continue
        hit, reach = reach <= limits_cells[1], min(reach, limits_cells[1])
        angle = first_rad + beam * step_rad
        row, column = int(scanner[1] + reach * math.sin(angle)), int(scanner[0] + reach * math.cos(angle))
        if hit:
            hits[row, column] += 1
        else:
            free_ends[row, column] = 1


def is_sound(scan: RangeScan) -> bool:
    """Tell whether a scan can be projected."""
    numbers = (scan.angle_min_rad, scan.angle_step_rad, scan.range_max_m)
    return all(math.isfinite(number) for number in numbers) and scan.range_m.ndim == 1 and scan.range_max_m > 0.0


class ScanGrid:
    """Labels the cells around the scanner from one scan; keeps nothing between scans."""

    def __init__(self, settings: ScanGridSettings, cell_m: float) -> None:
        """Cells of `cell_m`, aligned with odom."""
        self._settings = settings
        self._cell_m = cell_m

    def warm_up(self) -> None:
        """Compile every kernel, on a scan that knows nothing."""
        self.label(RangeScan(Stamp(0, 0, 0), 0.0, 0.1, np.full(4, np.nan), 1.0), SE2())

    def stamp(self, sensed: Sensed) -> Stamp | None:
        """Return the stamp of the newest scan that came; None: none came."""
        return sensed.scans[-1].stamp if sensed.scans else None

    def see(self, sensed: Sensed, odom_from_base: SE2) -> FrameLabels | None:
        """Return what that scan says; None: it is not sound."""
        if not sensed.scans or not is_sound(sensed.scans[-1]):
            return None
        return self.label(sensed.scans[-1], odom_from_base)

    def label(self, scan: RangeScan, odom_from_base: SE2) -> FrameLabels:
        """Return what a sound scan says, taken from the robot's pose at its capture; no return is free up to the range."""
        settings, cell_m = self._settings, self._cell_m
        lattice = lattice_in_reach(odom_from_base.x, odom_from_base.y, settings.range_max_m, cell_m)
        scanner = ((odom_from_base.x - lattice.x_m) / cell_m, (odom_from_base.y - lattice.y_m) / cell_m)
        hits = np.zeros((lattice.rows, lattice.columns), dtype=np.int32)
        free_ends = np.zeros((lattice.rows, lattice.columns), dtype=np.uint8)
        reach_m = min(settings.range_max_m, scan.range_max_m)
        limits = (settings.range_min_m / cell_m, reach_m / cell_m)
        first_rad = odom_from_base.yaw + scan.angle_min_rad
        _collect_scan(scan.range_m / cell_m, first_rad, float(scan.angle_step_rad), scanner, limits, hits, free_ends)
        grid = label_frame(lattice, hits, free_ends, scanner, settings.hits_min, settings.component_cells_min)
        return FrameLabels(grid, frozen_array(np.zeros(hits.shape, dtype=np.bool_)))
