"""From returns and ray ends to the three labels: free space by Bresenham's lines, hidden surfaces found by the same lines.

Source: Cui, Deng, Wang, appendix D.3, steps 5 and 6.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import FREE, OCCUPIED, U8, UNKNOWN
from estimators.grid.first_surfaces import first_surfaces, may_meet

Occupied = NDArray[Any]  # (rows, columns) uint8, 1 or 0
Counts = NDArray[Any]  # (rows, columns) int32


@kernel()
def _step(row: int, column: int, error: int, rows: int, columns: int, up: int, right: int) -> tuple[int, int, int]:
    """Take one step of Bresenham's line that spans `rows` and `columns` cells in the directions `up` and `right`."""
    twice = 2 * error
    if twice > -rows:
        error -= rows
        column += right
    if twice < columns:
        error += columns
        row += up
    return row, column, error


@kernel()
def _trace_free(occupied: Occupied, label: U8, row0: int, column0: int, row1: int, column1: int, with_end: bool) -> None:
    """Mark the line's cells free up to its end, or up to the first occupied cell; it never slips between two diagonal ones."""
    rows, columns = abs(row1 - row0), abs(column1 - column0)
    up, right = (1 if row1 > row0 else -1), (1 if column1 > column0 else -1)
    row, column, error = row0, column0, columns - rows
    while not occupied[row, column]:
        at_end = row == row1 and column == column1
        if not at_end or with_end:
            label[row, column] = FREE
        if at_end:
            return
        old_row, old_column = row, column
        row, column, error = _step(row, column, error, rows, columns, up, right)
        if row != old_row and column != old_column and occupied[old_row, column] and occupied[row, old_column]:
            return


@kernel()
def touching(occupied: Occupied) -> U8:
    """Return 1 for every cell that is occupied or has an occupied one among its eight neighbours, shape (rows, columns)."""
    rows, columns = occupied.shape
    touches = np.zeros((rows, columns), np.uint8)
    for row in range(rows):
        for column in range(columns):
            if occupied[row, column]:
                touches[max(row - 1, 0) : min(row + 2, rows), max(column - 1, 0) : min(column + 2, columns)] = 1
    return touches


@kernel()
def is_hidden(occupied: Occupied, touches: U8, row0: int, column0: int, row1: int, column1: int) -> bool:
    """Tell whether another surface stands between the camera's cell (row0, column0) and the cell (row1, column1).

    A surface seen at a shallow angle does not hide itself: a line must have left the first surface, by at least one cell
    that does not touch an occupied one (`touching`), before what follows counts as behind it.
    """
    rows, columns = abs(row1 - row0), abs(column1 - column0)
    up, right = (1 if row1 > row0 else -1), (1 if column1 > column0 else -1)
    row, column, error = row0, column0, columns - rows
    met = False
    while row != row1 or column != column1:
        if occupied[row, column]:
            met = True
        elif met and not touches[row, column]:
            return True
        row, column, error = _step(row, column, error, rows, columns, up, right)
    return False


@kernel()
def label_cells(occupied: Occupied, hits: Counts, free_ends: U8, row0: int, column0: int, label: U8) -> None:
    """Write the labels of all cells as seen from the cell (row0, column0).

    A ray ends where there are returns, or where `free_ends` says that it was still unobstructed.  With O the occupied
    cells, B those behind them and F the traced ones: O without B is occupied, F without B is free, and everything else, B
    included, is unknown.
    """
    label[:] = UNKNOWN
    for row in range(label.shape[0]):
        for column in range(label.shape[1]):
            if hits[row, column] > 0 or free_ends[row, column]:
                _trace_free(occupied, label, row0, column0, row, column, free_ends[row, column] != 0)
    touches, first = touching(occupied), first_surfaces(occupied, row0, column0)
    for row in range(label.shape[0]):
        for column in range(label.shape[1]):
            if occupied[row, column]:
                label[row, column] = OCCUPIED
            if label[row, column] == UNKNOWN or not may_meet(first, row - row0, column - column0):
                continue
            if is_hidden(occupied, touches, row0, column0, row, column):
                label[row, column] = UNKNOWN
