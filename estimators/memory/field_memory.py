"""Field memory in two layers of evidence that lie still in odom: a static one that fades slowly, a dynamic one that fades fast.

Source: Cui, Deng, Wang, section 4.1 and appendix B.  Occupied where it was seen so, and beyond view where the larger of the
two layers is at least a threshold; the clearance field is the distance transform of that (`estimators.clearance`).

Where the paper leaves a choice, or its word does not carry over:

- Retentions are per step of 0.2 s there; here they hold for that time, whatever the frame period.
- The paper does not say how evidence accumulates.  What stands where nothing was known is static at once, so that a wall that
  swept through the view stays; what came to stand on ground seen free shortly before gains static evidence slowly, so that a
  walker leaves none.
- The layers grow without bound there; here they reach so far around the robot, and what is left behind that is forgotten.
- Layers of 0.10 m would make every wall 0.10 m thick as soon as it leaves the view, and the field would jump.  Which cells of
  the finer grid were last seen occupied is kept beside them; the layers say for how long that is believed.
- Seen free makes free at once, but not in the blind zone right before the sensor, where an obstacle gives no return.
- Who came on into that zone can be carried on (`oncoming`): his last cells stay, and his front goes on before them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from drivers.interface.samples import frozen_array
from drivers.interface.settings import Settings
from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, FREE, OCCUPIED, UNKNOWN, Lattice, Mask, OccupancyGrid
from estimators.grid.labelling import FrameLabels
from estimators.memory.field_memory_kernels import fold_layers
from estimators.memory.memory_kernels import free_disc, in_the_open
from estimators.memory.oncoming import Oncoming
from estimators.memory.remembered import Remembered
from estimators.memory.rolling import cells_between, lattice_around, strays, transfer

NEVER_NS = -(2**62)
SECOND_NS = 1_000_000_000
STEP_NS = 200_000_000  # the period that the paper's retentions are meant for


class FieldMemorySettings(Settings):
    """The two layers; per-step values are for the paper's 0.2 s."""

    layer_cell_m: float = Field(default=0.10, ge=0.01, le=1.0, description="side of the layers' cells, a multiple of cell_m")
    extent_m: float = Field(default=16.0, gt=0.5, le=200.0, description="side of the square that the layers reach over")
    static_retention: float = Field(default=0.999, gt=0.0, lt=1.0, description="of the static layer, per 0.2 s")
    dynamic_retention: float = Field(default=0.5, gt=0.0, lt=1.0, description="of the dynamic layer, per 0.2 s")
    static_gain: float = Field(default=0.05, gt=0.0, le=1.0, description="gain per 0.2 s of what came where it was free")
    recently_free_s: float = Field(default=3.0, ge=0.0, le=3600.0, description="how long ago 'it was free' counts")
    carry_s: float = Field(default=1.5, ge=0.0, le=10.0, description="how long who came on into the blind zone goes on; 0: not")
    threshold: float = Field(default=0.3, gt=0.0, lt=1.0, description="evidence from which an unseen cell is occupied")


class FieldMemory:
    """The remembered grid; `merge` a frame, read `grid`."""

    def __init__(self, settings: FieldMemorySettings, window_m: float, cell_m: float, robot_radius_m: float) -> None:
        """Start with everything unknown but the ground under the robot, at the origin of odom.

        Raises:
            ConfigurationError: the layers' cells are no multiple of `cell_m`, or they do not reach over the window.
        """
        self._settings, self._radius_m, self._scale = settings, robot_radius_m, round(settings.layer_cell_m / cell_m)
        if self._scale < 1 or not math.isclose(self._scale * cell_m, settings.layer_cell_m):
            raise ConfigurationError(
                f"estimator.memory.layers.layer_cell_m {settings.layer_cell_m} must be a multiple of estimator.cell_m {cell_m}"
            )
        if settings.extent_m < window_m + 4.0 * settings.layer_cell_m:
            raise ConfigurationError(
                f"estimator.memory.layers.extent_m {settings.extent_m} must exceed estimator.memory.window_m {window_m} "
                "by four of the layers' cells"
            )
        side = max(1, round(window_m / cell_m))
        self._window = lattice_around(0.0, 0.0, cell_m, side, side)
        layers = round(settings.extent_m / settings.layer_cell_m)
        self._layers = lattice_around(0.0, 0.0, self._scale * cell_m, layers, layers)
        self._label = np.full((layers * self._scale,) * 2, UNKNOWN, dtype=np.uint8)
        self._static, self._dynamic = (np.zeros((layers, layers), dtype=np.float32) for _ in range(2))
        self._free_ns, self._stamp_ns = (np.full((layers, layers), NEVER_NS, dtype=np.int64) for _ in range(2))
        self._frame_ns = NEVER_NS
        self._oncoming, self._carried = Oncoming(settings.carry_s), np.zeros((0, 2))  # cells that he was carried to, in odom
        self._clear_footprint(SE2())

    @property
    def grid(self) -> OccupancyGrid:
        """What is remembered now, as a copy."""
        return OccupancyGrid(self._window, frozen_array(transfer(self._label, self._cells, self._window, UNKNOWN)))

    @property
    def remembered(self) -> Remembered:
        """The grid and what else is known of its cells; what came is occupied where the static layer does not say so."""
        came = self._fine(self._static < self._settings.threshold)
        open_ground = self._fine(in_the_open(self._free_ns, NEVER_NS))
        grid = self.grid
        return Remembered(grid, np.asarray(came & (grid.label == OCCUPIED)), open_ground)

    def _fine(self, layer: Mask) -> Mask:
        """Return a layer's cells on the window."""
        return transfer(layer.repeat(self._scale, axis=0).repeat(self._scale, axis=1), self._cells, self._window, False)

    @property
    def _cells(self) -> Lattice:
        """Where the labels lie: as the layers, in finer cells."""
        at, scale = self._layers, self._scale
        return Lattice(at.x_m, at.y_m, self._window.cell_m, at.rows * scale, at.columns * scale)

    def strays(self, odom_from_base: SE2) -> bool:
        """Tell whether the robot has come more than a quarter of the window away from its middle."""
        return strays(self._window, odom_from_base)

    def follow(self, odom_from_base: SE2) -> None:
        """Take the window along, so that the robot stands in its middle cell, and free the ground under it."""
        self._roll(odom_from_base)
        self._clear_footprint(odom_from_base)

    def _roll(self, odom_from_base: SE2) -> None:
        """Move the window, and the layers under it only when it would leave them: moving them costs a copy."""
        window, scale = self._window, self._scale
        self._window = lattice_around(odom_from_base.x, odom_from_base.y, window.cell_m, window.rows, window.columns)
        up, right = cells_between(self._cells, self._window)
        room = self._layers.rows * scale - self._window.rows - scale  # the block around the window may reach farther
        if 0 <= up <= room and 0 <= right <= room:
            return
        old, old_cells = self._layers, self._cells
        self._layers = lattice_around(odom_from_base.x, odom_from_base.y, old.cell_m, old.rows, old.columns)
        self._label = transfer(self._label, old_cells, self._cells, UNKNOWN)
        self._static, self._dynamic = (transfer(layer, old, self._layers, 0.0) for layer in (self._static, self._dynamic))
        self._free_ns = transfer(self._free_ns, old, self._layers, NEVER_NS)
        self._stamp_ns = transfer(self._stamp_ns, old, self._layers, NEVER_NS)

    def merge(self, frame: FrameLabels, stamp_ns: int, odom_from_base: SE2) -> None:
        """Fold in one frame that was captured at `stamp_ns` with the robot at `odom_from_base`."""
        self._roll(odom_from_base)
        settings, scale = self._settings, self._scale
        steps = min((stamp_ns - self._frame_ns) / STEP_NS, 1.0)  # a pause is no evidence
        self._mark(self._carried, OCCUPIED, FREE)
        corner, block = self._block()
        source = frame.grid.lattice
        fold_layers(
            self._label,
            self._static,
            self._dynamic,
            self._free_ns,
            self._stamp_ns,
            transfer(frame.grid.label, source, block, UNKNOWN),
            transfer(frame.blind, source, block, False),
            corner,
            scale,
            stamp_ns,
            round(settings.recently_free_s * 1e9),
            (settings.static_retention, settings.dynamic_retention),
            STEP_NS,
            1.0 - (1.0 - settings.static_gain) ** steps,
            settings.dynamic_retention**steps,
            settings.threshold,
        )
        self._frame_ns = stamp_ns
        self._carry(frame, stamp_ns, odom_from_base)
        self._clear_footprint(odom_from_base)

    def _carry(self, frame: FrameLabels, stamp_ns: int, odom_from_base: SE2) -> None:
        """Mark the free cells of the blind zone that somebody who came on into it must have got to."""
        if self._settings.carry_s <= 0.0:
            return
        source, robot = frame.grid.lattice, np.array([odom_from_base.x, odom_from_base.y])
        rows, columns = np.nonzero(frame.grid.label == OCCUPIED)
        cells = source.centres(rows, columns)
        inside, at = _inside(self._layers, cells)
        came = np.zeros(len(cells), np.bool_)
        came[inside] = self._static[at] < self._settings.threshold
        front = self._oncoming.update(cells[came], robot, stamp_ns / SECOND_NS)
        within, at = _inside(source, front)
        front = front[within][frame.blind[at]]
        self._carried = self._mark(front, FREE, OCCUPIED)

    def _mark(self, points: F64, what: int, label: int) -> F64:
        """Overwrite the labels at points, shape (n, 2), where they are `what`; return those, shape (m, 2)."""
        within, at = _inside(self._cells, points)
        changes = self._label[at] == what
        rows, columns = at
        self._label[rows[changes], columns[changes]] = label
        return np.asarray(points[within][changes])

    def _block(self) -> tuple[tuple[int, int], Lattice]:
        """Return where the layers' cells under the window begin, by row and column, and their lattice in finer cells."""
        cells, scale = self._cells, self._scale
        up, right = cells_between(cells, self._window)
        row, column = up // scale, right // scale
        side = (-(-self._window.rows // scale) + 1) * scale
        corner_m = cells.x_m + column * scale * cells.cell_m, cells.y_m + row * scale * cells.cell_m
        return (row, column), Lattice(*corner_m, cells.cell_m, side, side)

    def _clear_footprint(self, odom_from_base: SE2) -> None:
        at, cell_m = self._layers, self._window.cell_m
        free_disc(
            self._label, (odom_from_base.x - at.x_m) / cell_m, (odom_from_base.y - at.y_m) / cell_m, self._radius_m / cell_m
        )

    def snapshot(self) -> bytes:
        """Return the whole state."""
        return pack(
            window=(self._window.x_m, self._window.y_m),
            layers=(self._layers.x_m, self._layers.y_m),
            label=self._label,
            static=self._static,
            dynamic=self._dynamic,
            free_ns=self._free_ns,
            stamp_ns=self._stamp_ns,
            frame_ns=self._frame_ns,
            carried=self._carried,
            **self._oncoming.state(),
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state, window, layers = unpack(snapshot), self._window, self._layers
        (wx, wy), (lx, ly) = state["window"].tolist(), state["layers"].tolist()
        self._window = Lattice(wx, wy, window.cell_m, window.rows, window.columns)
        self._layers = Lattice(lx, ly, layers.cell_m, layers.rows, layers.columns)
        self._label, self._static, self._dynamic = state["label"], state["static"], state["dynamic"]
        self._free_ns, self._stamp_ns, self._frame_ns = state["free_ns"], state["stamp_ns"], int(state["frame_ns"])
        self._carried = state["carried"]
        self._oncoming.take(state)


def _inside(lattice: Lattice, points: F64) -> tuple[Mask, tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Return which points, shape (n, 2), lie on a lattice, shape (n,), and the rows and columns of those."""
    rows, columns = lattice.cell_of(points)
    inside = (rows >= 0) & (rows < lattice.rows) & (columns >= 0) & (columns < lattice.columns)
    return inside, (rows[inside], columns[inside])
