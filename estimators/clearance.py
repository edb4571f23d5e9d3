"""The clearance field: how far the nearest occupied cell is, and how fast that changes for reasons other than ego-motion."""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import Field

from drivers.interface.samples import frozen_array
from drivers.interface.settings import Settings
from drivers.interface.stateful import pack, unpack
from estimators.belief import F32, OCCUPIED, UNKNOWN, ClearanceField, Lattice, Mask, OccupancyGrid
from estimators.memory.rolling import transfer

PAPER_STEP_S = 0.2  # the period that the paper's smoothing factor is meant for
RATE_MASK = cv2.DIST_MASK_5  # integer chamfer, within 2 % of the true distance in half the time: enough for a rate
SECOND_NS = 1_000_000_000


class ClearanceSettings(Settings):
    """Whether and how the rate is made."""

    rate: bool = Field(default=True, description="whether the rate is worked out; false where nobody reads it, it is zero then")
    rate_smoothing: float = Field(default=0.3, gt=0.0, le=1.0, description="weight of a new rate, per 0.2 s as in the paper")


def _to_nearest(occupied: Mask, mask_size: int) -> F32:
    """Return the distance [cells] to the nearest occupied cell as OpenCV gives it, capped at the longer side."""
    obstacles_as_zero = np.logical_not(occupied).view(np.uint8)
    cells = cv2.distanceTransform(obstacles_as_zero, cv2.DIST_L2, mask_size)
    return np.minimum(cells, np.float32(max(occupied.shape)), dtype=np.float32)


def distance_to(occupied: Mask, cell_m: float) -> F32:
    """Return the distance [m] from each cell's centre to that of the nearest occupied one, shape (rows, columns).

    It is capped at the longer side of the lattice, which is also the answer where nothing is occupied.  OpenCV's last bits
    depend on where the array lies in memory; squares of distances are whole numbers of cells, so rounding them makes the
    field exact and the same every time.
    """
    cells = _to_nearest(occupied, cv2.DIST_MASK_PRECISE)
    return np.asarray(np.sqrt(np.rint(cells * cells)) * np.float32(cell_m), dtype=np.float32)


def _bounding_box(mask: Mask) -> tuple[slice, slice]:
    """Return the rows and columns that hold every set cell; the first cell where none is set."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not rows.size:
        return slice(0, 1), slice(0, 1)
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)


def _field_of(grid: OccupancyGrid, rate: F32, known: Mask, overlap: Mask) -> ClearanceField:
    clearance = distance_to(grid.label == OCCUPIED, grid.lattice.cell_m)
    return ClearanceField(
        lattice=grid.lattice,
        clearance_m=frozen_array(clearance),
        rate_m_s=frozen_array(rate),
        known=frozen_array(known),
        overlap=frozen_array(overlap),
    )


class ClearanceEstimator:
    """Turns the grids of successive frames into clearance fields.

    The rate is the difference of equation 1 (Cui, Deng, Wang, section 4.1) between frames, cell by cell in odom, over the
    time between their captures.  Both fields of the difference are built from cells that were known at both frames: a wall
    that comes into view, or an obstacle that is forgotten, changes what is known, not how anything moves.
    """

    def __init__(self, settings: ClearanceSettings) -> None:
        """Start without a frame before."""
        self._settings = settings
        self._grid: OccupancyGrid | None = None  # at the last frame
        self._field: ClearanceField | None = None
        self._stamp_ns = 0

    def update(self, grid: OccupancyGrid, stamp_ns: int) -> ClearanceField:
        """Return the field for a grid at `stamp_ns`; with the stamp of the frame before, rates are carried over."""
        known = grid.label != UNKNOWN
        if self._grid is None or self._field is None or not self._settings.rate:
            overlap, rate = np.zeros_like(known), np.zeros(known.shape, dtype=np.float32)
        else:
            overlap, rate = self._smoothed_rate(self._grid, self._field.rate_m_s, grid, known, stamp_ns)
        self._grid, self._field, self._stamp_ns = grid, _field_of(grid, rate, known, overlap), stamp_ns
        return self._field

    def _smoothed_rate(
        self, before: OccupancyGrid, rate_before: F32, grid: OccupancyGrid, known: Mask, stamp_ns: int
    ) -> tuple[Mask, F32]:
        label = transfer(before.label, before.lattice, grid.lattice, UNKNOWN)
        rate = transfer(rate_before, before.lattice, grid.lattice, 0.0)
        overlap = known & (label != UNKNOWN)
        elapsed_s = (stamp_ns - self._stamp_ns) / SECOND_NS
        if elapsed_s > 0.0:
            weight = np.float32(1.0 - (1.0 - self._settings.rate_smoothing) ** (elapsed_s / PAPER_STEP_S))
            box = _bounding_box(overlap)  # nothing outside it counts, and no shortest way leaves it
            was, now = (labels[box] == OCCUPIED for labels in (label, grid.label))
            change_cells = _to_nearest(now & overlap[box], RATE_MASK) - _to_nearest(was & overlap[box], RATE_MASK)
            rate[box] += weight * (change_cells * np.float32(grid.lattice.cell_m / elapsed_s) - rate[box])
        return overlap, rate * overlap

    def snapshot(self) -> bytes:
        """Return the whole state."""
        if self._grid is None or self._field is None:
            return pack()
        lattice = self._grid.lattice
        return pack(
            corner=(lattice.x_m, lattice.y_m, lattice.cell_m),
            label=self._grid.label,
            rate=self._field.rate_m_s,
            overlap=self._field.overlap,
            stamp_ns=self._stamp_ns,
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        self._grid, self._field, self._stamp_ns = None, None, 0
        if state:
            label = frozen_array(state["label"])
            self._grid = OccupancyGrid(Lattice(*state["corner"].tolist(), *label.shape), label)
            self._field = _field_of(self._grid, state["rate"], label != UNKNOWN, state["overlap"])
            self._stamp_ns = int(state["stamp_ns"])

    @property
    def field(self) -> ClearanceField | None:
        """The field of the last frame; None before the first."""
        return self._field
