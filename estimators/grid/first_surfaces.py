"""How far one can look in each direction before the first surface: most lines need not be walked to know that they meet none.

Bresenham's line takes one cell of each row (or of each column, where it leads more across than up), and there it is less than
a cell away from the straight line.  So an occupied cell is in the way of such lines only as lead to it, give or take a cell.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

Occupied = NDArray[Any]  # (rows, columns) uint8, 1 or 0
I64 = NDArray[np.int64]

_SIDES = 4  # lines that lead mostly up the rows, down the rows, up the columns, down the columns


@kernel()
def _from_side(side: int, rows: int, columns: int) -> tuple[int, int]:
    """Return how many cells a way of `rows` and `columns` leads along a side's direction, and how many across it."""
    along, across = (rows, columns) if side < 2 else (columns, rows)
    return (-along if side % 2 else along), across


@kernel()
def _sector(along: int, across: int, sectors: int) -> int:
    """Return in which of the sectors of its side a way leads."""
    slope = min(max(across / along, -1.0), 1.0)
    return int(0.5 * (slope + 1.0) * (sectors - 1))


@kernel()
def first_surfaces(occupied: Occupied, row0: int, column0: int) -> I64:
    """Return after how many cells from (row0, column0) a line may meet a surface, by side and sector, shape (4, sectors)."""
    rows, columns = occupied.shape
    sectors = 2 * max(rows, columns)
    first = np.full((_SIDES, sectors), rows + columns)
    for row in range(rows):
        for column in range(columns):
            if not occupied[row, column]:
                continue
            for side in range(_SIDES):
                along, across = _from_side(side, row - row0, column - column0)
                if along > 0:
                    low, high = _sector(along, across - 1, sectors), _sector(along, across + 1, sectors)
                    first[side, low : high + 1] = np.minimum(first[side, low : high + 1], along)
                elif along == 0 and across == 0:
                    first[side] = 0
    return first


@kernel()
def may_meet(first: I64, rows: int, columns: int) -> bool:
    """Tell whether the line that leads on by `rows` and `columns` may meet a surface before its last cell; False is certain."""
    mostly_across = abs(columns) > abs(rows)
    backwards = (columns if mostly_across else rows) < 0
    side = 2 * int(mostly_across) + int(backwards)
    along, across = _from_side(side, rows, columns)
    return bool(along > 0 and first[side, _sector(along, across, first.shape[1])] < along)
