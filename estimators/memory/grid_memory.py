"""What is remembered of the cells around the robot: a window of odom that rolls along by whole cells.

Seen cells overwrite, unseen cells keep their label, free and unknown for as long as they lie in the window, occupied for a
retention time.  There are two: what came to stand where it was free shortly before is taken for something that moves on, and
is soon forgotten where it is no longer seen, so that a walker leaves no wall behind; in the blind zone right before the
sensor nothing is forgotten, since an obstacle there gives no return.

The two retentions stand for the two layers of Cui, Deng, Wang, section 4.1, whose fast one halves every 0.2 s.
"""

from __future__ import annotations

import numpy as np
from pydantic import Field

from drivers.interface.geometry import SE2
from drivers.interface.samples import frozen_array
from drivers.interface.settings import Settings
from drivers.interface.stateful import pack, unpack
from estimators.belief import OCCUPIED, UNKNOWN, Lattice, OccupancyGrid
from estimators.grid.labelling import FrameLabels
from estimators.memory.memory_kernels import fold, free_disc, in_the_open
from estimators.memory.remembered import Remembered
from estimators.memory.rolling import lattice_around, strays, transfer

NEVER_NS = -(2**62)
SECOND_NS = 1_000_000_000


class GridMemorySettings(Settings):
    """How long occupied cells are believed unseen."""

    static_retention_s: float = Field(default=60.0, gt=0.0, le=3600.0, description="for what has always stood there")
    dynamic_retention_s: float = Field(default=0.5, gt=0.0, le=3600.0, description="for what came to stand where it was free")
    recently_free_s: float = Field(default=3.0, ge=0.0, le=3600.0, description="how long ago 'it was free' counts")
    settle_s: float = Field(default=1.5, gt=0.0, le=3600.0, description="after so long in the same cell it counts as static")


def _ns(seconds: float) -> int:
    return round(seconds * SECOND_NS)


class GridMemory:
    """The remembered grid; `merge` a frame, read `grid`."""

    def __init__(self, settings: GridMemorySettings, window_m: float, cell_m: float, robot_radius_m: float) -> None:
        """Start with everything unknown but the ground under the robot, at the origin of odom."""
        self._settings = settings
        self._radius_m = robot_radius_m
        side = max(1, round(window_m / cell_m))
        self._lattice = lattice_around(0.0, 0.0, cell_m, side, side)
        shape = (side, side)
        self._label = np.full(shape, UNKNOWN, dtype=np.uint8)
        self._free_ns = np.full(shape, NEVER_NS, dtype=np.int64)
        self._occupied_ns = np.full(shape, NEVER_NS, dtype=np.int64)
        self._since_ns = np.full(shape, NEVER_NS, dtype=np.int64)
        self._dynamic = np.zeros(shape, dtype=np.bool_)
        self._clear_footprint(SE2())

    @property
    def grid(self) -> OccupancyGrid:
        """What is remembered now, as a copy."""
        return OccupancyGrid(self._lattice, frozen_array(self._label.copy()))

    @property
    def remembered(self) -> Remembered:
        """The grid and what else is known of its cells."""
        came = np.asarray(self._dynamic & (self._label == OCCUPIED))
        return Remembered(self.grid, came, in_the_open(self._free_ns, NEVER_NS))

    def strays(self, odom_from_base: SE2) -> bool:
        """Tell whether the robot has come more than a quarter of the window away from the middle."""
        return strays(self._lattice, odom_from_base)

    def follow(self, odom_from_base: SE2) -> None:
        """Roll the window along, so that the robot stands in its middle cell, and free the ground under it."""
        self._roll(odom_from_base)
        self._clear_footprint(odom_from_base)

    def _roll(self, odom_from_base: SE2) -> None:
        old = self._lattice
        self._lattice = lattice_around(odom_from_base.x, odom_from_base.y, old.cell_m, old.rows, old.columns)
        if self._lattice != old:
            self._label = transfer(self._label, old, self._lattice, UNKNOWN)
            self._free_ns = transfer(self._free_ns, old, self._lattice, NEVER_NS)
            self._occupied_ns = transfer(self._occupied_ns, old, self._lattice, NEVER_NS)
            self._since_ns = transfer(self._since_ns, old, self._lattice, NEVER_NS)
            self._dynamic = transfer(self._dynamic, old, self._lattice, False)

    def merge(self, frame: FrameLabels, stamp_ns: int, odom_from_base: SE2) -> None:
        """Fold in one frame that was captured at `stamp_ns` with the robot at `odom_from_base`."""
        self._roll(odom_from_base)
        source, settings = frame.grid.lattice, self._settings
        fold(
            self._label,
            self._free_ns,
            self._occupied_ns,
            self._since_ns,
            self._dynamic,
            transfer(frame.grid.label, source, self._lattice, UNKNOWN),
            transfer(frame.blind, source, self._lattice, False),
            stamp_ns,
            _ns(settings.recently_free_s),
            _ns(settings.settle_s),
            _ns(settings.static_retention_s),
            _ns(settings.dynamic_retention_s),
        )
        self._clear_footprint(odom_from_base)

    def _clear_footprint(self, odom_from_base: SE2) -> None:
        lattice = self._lattice
        x, y = (odom_from_base.x - lattice.x_m) / lattice.cell_m, (odom_from_base.y - lattice.y_m) / lattice.cell_m
        free_disc(self._label, x, y, self._radius_m / lattice.cell_m)

    def snapshot(self) -> bytes:
        """Return the whole state."""
        return pack(
            corner=(self._lattice.x_m, self._lattice.y_m),
            label=self._label,
            free_ns=self._free_ns,
            occupied_ns=self._occupied_ns,
            since_ns=self._since_ns,
            dynamic=self._dynamic,
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state, old = unpack(snapshot), self._lattice
        x, y = state["corner"].tolist()
        self._lattice = Lattice(x, y, old.cell_m, old.rows, old.columns)
        self._label, self._dynamic = state["label"], state["dynamic"]
        self._free_ns, self._occupied_ns, self._since_ns = state["free_ns"], state["occupied_ns"], state["since_ns"]
