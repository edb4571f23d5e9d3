"""Futures that respect what stands still: who comes to a wall goes on along it, not through it.

Source: Han, Zhu, RCSP, section 4.2: futures are drawn given the map memory, Q_theta(. | s_t, M_t).  How is ours.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import Mask

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

_OWN_M = 0.3  # cells this near to where a future begins may be the obstacle's own
_SHARE = 0.7  # of a radius may overlap a wall: neither a track's place nor its width is exact
_STRIDE = 2  # steps between two looks


class Walls(NamedTuple):
    """The distance to what stands still, odom frame; beyond the field nothing is known to stand."""

    clearance: F32  # (rows, columns), to the centres of occupied cells
    corner_x: float
    corner_y: float
    cell_m: float


@kernel()
def slid(field: F32, row: np.uint32, column: np.uint32, dx: np.float32, dy: np.float32) -> tuple[np.float32, np.float32]:
    """Return what is left of a motion, (dx, dy), from a cell before a wall: its part towards it is taken away.

    Where the field does not say where the wall is, nothing is left.
    """
    across = field[row, column + 1] - field[row, column - 1]
    up = field[row + 1, column] - field[row - 1, column]
    squared, towards = across * across + up * up, dx * across + dy * up
    if squared == np.float32(0.0):
        return np.float32(0.0), np.float32(0.0)
    if towards >= np.float32(0.0):
        return dx, dy
    return dx - towards * across / squared, dy - towards * up / squared


@kernel()
def keep_out(position: F32, radius: F64, walls: Walls) -> None:
    """Change futures, shape (steps, obstacles, 2, scenarios), so that nobody goes through a wall; what follows moves along.

    Args:
        position: changed in place.
        radius: of the obstacles, shape (obstacles,).
        walls: what stands still.
    """
    meets = np.empty(position.shape[3], np.bool_)
    for m in range(position.shape[1]):
        limit = np.float32(_SHARE * radius[m])
        _meet(position[:, m], limit, walls, meets)
        for i in range(len(meets)):
            if meets[i]:
                _keep_out(position[:, m, :, i], limit, walls)


@kernel()
def _meet(own: F32, limit: np.float32, walls: Walls, meets: Mask) -> None:
    """Write which of the futures of one obstacle, shape (steps, 2, scenarios), come within a limit of a wall, (scenarios,)."""
    field, per_cell, one = walls.clearance, np.float32(1.0 / walls.cell_m), np.float32(1.0)
    left, bottom = np.float32(walls.corner_x), np.float32(walls.corner_y)
    last_row, last_column = np.float32(field.shape[0] - 1), np.float32(field.shape[1] - 1)
    meets[:] = False
    for k in range(_STRIDE, len(own), _STRIDE):
        x, y = own[k, 0], own[k, 1]
        for i in range(len(meets)):
            column, row = (x[i] - left) * per_cell, (y[i] - bottom) * per_cell
            if one <= row < last_row and one <= column < last_column:
                meets[i] |= field[np.uint32(row), np.uint32(column)] < limit


@kernel()
def _keep_out(way: F32, limit: np.float32, walls: Walls) -> None:
    """Change one future of one obstacle, shape (steps, 2)."""
    field, per_cell, own = walls.clearance, np.float32(1.0 / walls.cell_m), np.float32(_OWN_M * _OWN_M)
    left, bottom = np.float32(walls.corner_x), np.float32(walls.corner_y)
    last_row, last_column = np.float32(field.shape[0] - 1), np.float32(field.shape[1] - 1)
    start_x, start_y, off_x, off_y, one = way[0, 0], way[0, 1], np.float32(0.0), np.float32(0.0), np.float32(1.0)
    px, py, done = start_x, start_y, 0
    for k in range(_STRIDE, len(way), _STRIDE):
        x, y = way[k, 0] + off_x, way[k, 1] + off_y
        column, row = (x - left) * per_cell, (y - bottom) * per_cell
        inside = one <= row < last_row and one <= column < last_column
        beyond = (x - start_x) * (x - start_x) + (y - start_y) * (y - start_y) > own
        if inside and beyond and field[np.uint32(row), np.uint32(column)] < limit:
            column, row = (px - left) * per_cell, (py - bottom) * per_cell
            dx, dy = np.float32(0.0), np.float32(0.0)
            if one <= row < last_row and one <= column < last_column:
                dx, dy = slid(field, np.uint32(row), np.uint32(column), x - px, y - py)
            x, y = px + dx, py + dy
            off_x, off_y = x - way[k, 0], y - way[k, 1]
        if off_x != np.float32(0.0) or off_y != np.float32(0.0):
            for j in range(done + 1, k):
                way[j, 0], way[j, 1] = np.float32(0.5) * (px + x), np.float32(0.5) * (py + y)
            way[k, 0], way[k, 1] = x, y
        px, py, done = x, y, k
    for j in range(done + 1, len(way)):
        way[j, 0] += off_x
        way[j, 1] += off_y
