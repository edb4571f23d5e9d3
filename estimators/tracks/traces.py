"""Ground that was left: cells that a frame lately saw occupied, and that now are free or in the shadow of what stands before.

What stands still leaves no ground, whatever is known of the ground around it: so what came from where nobody had looked yet, or
goes away from the sensor over ground that it hides, is told from a wall that comes into range.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, OCCUPIED, Lattice, Mask, OccupancyGrid
from estimators.memory.rolling import transfer
from estimators.tracks.components import sizes
from estimators.tracks.tracking_kernels import count_left, keep_times

NEVER_NS = -(2**62)
SPAN_NS = 1_000_000_000  # how long ago ground may have been left
YOUNG_NS = 1_500_000_000  # what stands in its cells for longer does not move
YOUNG_SHARE = 0.8  # of a surface's cells
LEFT_MIN = 5  # cells; fewer are noise
WIDEST_M = 0.75  # across a surface, unless told otherwise; a wider one is a wall's, or holds a piece of one


class Traces:
    """When each cell around the robot was last seen occupied, and since when it is."""

    def __init__(self, widest_m: float = WIDEST_M) -> None:
        """Start with nothing seen; surfaces wider than this leave no ground."""
        self._widest_m = widest_m
        self._lattice = Lattice(0.0, 0.0, 1.0, 0, 0)
        self._seen_ns: NDArray[np.int64] = np.zeros((0, 0), dtype=np.int64)
        self._since_ns: NDArray[np.int64] = np.zeros((0, 0), dtype=np.int64)

    def moving(self, grid: OccupancyGrid, component: NDArray[Any], across_m: F64, stamp_ns: int) -> Mask:
        """Take in a frame; return which components have left ground, shape (components,).

        Args:
            grid: what the frame shows.
            component: of each cell, (rows, columns); 0 is none.
            across_m: how wide each component is, (components,).
            stamp_ns: when it was captured.
        """
        lattice, label = grid.lattice, grid.label
        if self._lattice.cell_m != lattice.cell_m:
            self._lattice, self._seen_ns, self._since_ns = lattice, *(np.full(label.shape, NEVER_NS) for _ in range(2))
        self._seen_ns, self._since_ns = (
            transfer(times, self._lattice, lattice, NEVER_NS) for times in (self._seen_ns, self._since_ns)
        )
        self._lattice = lattice
        left = np.zeros(len(across_m), dtype=np.int64)
        count_left(label, component, self._seen_ns, stamp_ns - SPAN_NS, left)
        keep_times(label, self._seen_ns, self._since_ns, stamp_ns, stamp_ns - SPAN_NS, NEVER_NS)
        seen = label == OCCUPIED
        young = seen & (self._since_ns >= stamp_ns - YOUNG_NS)
        came = sizes(component, young, len(left)) > YOUNG_SHARE * sizes(component, seen, len(left))
        return np.asarray((left >= LEFT_MIN) & came & (across_m <= self._widest_m))

    def snapshot(self) -> bytes:
        """Return the whole state."""
        return pack(
            corner=(self._lattice.x_m, self._lattice.y_m, self._lattice.cell_m), seen_ns=self._seen_ns, since_ns=self._since_ns
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        self._seen_ns, self._since_ns = state["seen_ns"], state["since_ns"]
        self._lattice = Lattice(*state["corner"].tolist(), *self._seen_ns.shape)
