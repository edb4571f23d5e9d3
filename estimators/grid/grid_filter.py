"""The filtered branch: labels smoothed over frames, then by a median, then by opening and closing; off in the paper's deployment.

Source: Cui, Deng, Wang, appendix D.3, step 7.  What differs:

- The paper's factor 0.65 is per frame of its camera, 30 a second; here it holds for that time, whatever the frame period.
- Cells lie still in odom, so that what is smoothed is the world and not the picture.
- Near the sensor the labels stay as they are.  Smoothing takes frames to believe in a new obstacle and opening removes thin
  ones, and what lingers would be a phantom; both are for far returns, where noise is, and not for what must be braked for.
- What the filter takes away is unknown, not free: a return was there.
- Walls are one cell thick, since nothing is seen behind a surface.  In the median what is unknown counts as half, or it would
  take away every wall; opening would do so as well and has a radius of 0 by default.
"""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import Field

from drivers.interface.samples import frozen_array
from drivers.interface.settings import Settings
from drivers.interface.stateful import pack, unpack
from estimators.belief import F32, OCCUPIED, U8, UNKNOWN, Lattice, Mask, OccupancyGrid
from estimators.grid.labelling import FrameLabels
from estimators.memory.rolling import transfer

PAPER_FRAME_NS = 1_000_000_000 / 30
NEVER_NS = -(2**62)
HALF, YES = 1, 2  # votes in the median


class GridFilterSettings(Settings):
    """How strongly labels are filtered, and from which distance on."""

    temporal_retention: float = Field(default=0.65, ge=0.0, lt=1.0, description="of the occupancy before, per 1/30 s")
    median_radius_m: float = Field(default=0.05, ge=0.0, le=0.5, description="half the median's square, beside its cell")
    opening_radius_m: float = Field(default=0.0, ge=0.0, le=0.5, description="what is thinner than twice this is removed")
    closing_radius_m: float = Field(default=0.05, ge=0.0, le=0.5, description="gaps narrower than twice this are filled")
    near_m: float = Field(default=1.5, ge=1.5, le=20.0, description="nearer to the sensor than this nothing is filtered")


def _disc(radius_cells: int) -> U8:
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius_cells + 1,) * 2), dtype=np.uint8)


class GridFilter:
    """Filters the labels of successive frames."""

    def __init__(self, settings: GridFilterSettings, cell_m: float) -> None:
        """Start without a frame before."""
        self._settings = settings
        self._median = 2 * round(settings.median_radius_m / cell_m) + 1  # side of the square [cells]
        self._opening, self._closing = (
            _disc(round(radius / cell_m)) for radius in (settings.opening_radius_m, settings.closing_radius_m)
        )
        self._probability: F32 = np.zeros((1, 1), dtype=np.float32)  # of being occupied, on `_lattice`
        self._lattice = Lattice(0.0, 0.0, cell_m, 1, 1)
        self._stamp_ns = NEVER_NS

    def apply(self, frame: FrameLabels, stamp_ns: int) -> FrameLabels:
        """Return the frame, captured at `stamp_ns`, with the labels beyond `near_m` filtered; its sensor is in the middle."""
        raw, lattice = frame.grid.label, frame.grid.lattice
        kept = self._settings.temporal_retention ** ((stamp_ns - self._stamp_ns) / PAPER_FRAME_NS)
        before = transfer(self._probability, self._lattice, lattice, 0.0)
        self._probability = np.asarray(kept * before + (1.0 - kept) * (raw == OCCUPIED), dtype=np.float32)
        self._lattice, self._stamp_ns = lattice, stamp_ns
        occupied = self._smooth(self._probability > 0.5, raw == UNKNOWN) != 0
        label = np.where(occupied, OCCUPIED, np.where(raw == OCCUPIED, UNKNOWN, raw)).astype(np.uint8)
        near = self._near(lattice)
        label[near] = raw[near]
        return FrameLabels(OccupancyGrid(lattice, frozen_array(label)), frame.blind)

    def _smooth(self, occupied: Mask, unknown: Mask) -> U8:
        votes = np.where(occupied, YES, np.where(unknown, HALF, 0)).astype(np.uint8)
        median = cv2.medianBlur(votes, self._median)
        smoothed = ((median == YES) | (occupied & (median == HALF))).astype(np.uint8)
        smoothed = cv2.morphologyEx(smoothed, cv2.MORPH_OPEN, self._opening)
        return np.asarray(cv2.morphologyEx(smoothed, cv2.MORPH_CLOSE, self._closing), dtype=np.uint8)

    def _near(self, lattice: Lattice) -> Mask:
        """Return which cells have a part nearer to the middle cell than `near_m`, shape (rows, columns)."""
        rows, columns = np.ogrid[: lattice.rows, : lattice.columns]
        reach_cells = self._settings.near_m / lattice.cell_m + 2.0  # a cell's diagonal, and where in its cell the sensor is
        return np.asarray((rows - lattice.rows // 2) ** 2 + (columns - lattice.columns // 2) ** 2 <= reach_cells**2)

    def snapshot(self) -> bytes:
        """Return the whole state."""
        corner = (self._lattice.x_m, self._lattice.y_m)
        return pack(corner=corner, probability=self._probability, stamp_ns=self._stamp_ns)

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        x, y = state["corner"].tolist()
        self._probability, self._stamp_ns = state["probability"], int(state["stamp_ns"])
        self._lattice = Lattice(x, y, self._lattice.cell_m, *self._probability.shape)
