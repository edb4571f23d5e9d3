"""How one frame's labels change what is remembered, cell by cell."""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import FREE, OCCUPIED, U8, UNKNOWN

I64 = NDArray[Any]
Flags = NDArray[Any]  # bool


@kernel()
def fold(
    label: U8,  # (rows, columns), remembered; all of these change in place
    free_ns: I64,  # (rows, columns), when last seen free
    occupied_ns: I64,  # (rows, columns), when last seen occupied, or in the blind zone since
    since_ns: I64,  # (rows, columns), since when occupied without having been seen free
    dynamic: Flags,  # (rows, columns), whether occupied by something that came
    seen: U8,  # (rows, columns), the frame's labels
    blind: Flags,  # (rows, columns), where an obstacle may be too near to give returns
    now_ns: int,
    recent_ns: int,
    settle_ns: int,
    static_ns: int,
    dynamic_ns: int,
) -> None:
    """Overwrite what was seen; keep what was not, occupied cells no longer than their retention.

    Rays are drawn only to the nearest cell, so one that passes an obstacle by may graze it.  Farther away the next frame sees
    the obstacle again; where the sensor is blind none will, so there a ray takes nothing away.
    """
    for row in range(label.shape[0]):
        for column in range(label.shape[1]):
            at = row, column
            if seen[at] == FREE and not (blind[at] and label[at] == OCCUPIED):
                label[at], free_ns[at] = FREE, now_ns
            elif seen[at] == OCCUPIED:
                if label[at] != OCCUPIED:
                    since_ns[at], dynamic[at] = now_ns, now_ns - free_ns[at] <= recent_ns
                elif now_ns - since_ns[at] >= settle_ns:
                    dynamic[at] = False
                label[at], occupied_ns[at] = OCCUPIED, now_ns
            elif label[at] == OCCUPIED:
                if blind[at]:
                    occupied_ns[at] = now_ns
                elif now_ns - occupied_ns[at] > (dynamic_ns if dynamic[at] else static_ns):
                    label[at] = UNKNOWN


@kernel()
def free_disc(label: U8, x: float, y: float, radius: float) -> None:
    """Mark the cells free whose centres lie within a disc; centre and radius in cells from the lattice's corner."""
    rows, columns = label.shape
    for row in range(max(0, math.floor(y - radius)), min(rows, math.ceil(y + radius))):
        for column in range(max(0, math.floor(x - radius)), min(columns, math.ceil(x + radius))):
            if (column + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2 <= radius**2:
                label[row, column] = FREE


def in_the_open(free_ns: I64, never_ns: int) -> Flags:
    """Return which cells and all their neighbours have been seen free at some time, shape (rows, columns).

    A ray that ends just before a wall at a shallow angle makes the wall's cell free, but never those behind it.
    """
    seen = (free_ns > never_ns).view(np.uint8)
    return np.asarray(cv2.erode(seen, np.ones((3, 3), dtype=np.uint8)) != 0)
