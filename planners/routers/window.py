"""Places in the rolling window: cells around a point, its border, and how far it still is from there to a goal outside."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import Lattice

F64 = NDArray[np.float64]


def around(lattice: Lattice, point: F64, reach_m: float) -> tuple[NDArray[np.intp], NDArray[np.intp], F64]:
    """Return the cells in a square around a point, which holds all whose centres are within reach of it.

    Args:
        lattice: of the window.
        point: in odom, shape (2,).
        reach_m: how far.

    Returns:
        Rows, shape (m, 1), and columns, shape (n,), to be indexed with together; the centres' distances (m, n) [m].
    """
    (low_row, high_row), (low_column, high_column) = lattice.cell_of(np.stack((point - reach_m, point + reach_m)))
    rows = np.arange(max(low_row, 0), min(high_row + 1, lattice.rows))
    columns = np.arange(max(low_column, 0), min(high_column + 1, lattice.columns))
    x = lattice.x_m + (columns + 0.5) * lattice.cell_m - point[0]
    y = lattice.y_m + (rows + 0.5) * lattice.cell_m - point[1]
    return rows[:, None], columns, np.hypot(x, y[:, None])


@lru_cache(maxsize=4)  # a rolling window alternates between few shapes
def ring(rows: int, columns: int) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Return row, column and side of the border cells, each shape (n,); sides 0 to 3: lower y, upper x, upper y, lower x."""
    across, down = np.arange(columns), np.arange(rows)
    row = np.concatenate((np.zeros_like(across), down, np.full_like(across, rows - 1), down))
    column = np.concatenate((across, np.full_like(down, columns - 1), across, np.zeros_like(down)))
    side = np.repeat(np.arange(4), (columns, rows, columns, rows))
    return row, column, side


@kernel()
def remainder_outside(points: F64, side: NDArray[np.intp], low: F64, high: F64, goal: F64) -> F64:
    """Return the shortest way from border points to the goal that stays outside the window, shape (n,) [m].

    Outside, nothing is known: the way is straight where the point's side faces the goal and leads round the window's corners
    where it does not.  A straight line back through the window would pretend that what blocks the inside is not there.

    Args:
        points: on the border, shape (n, 2).
        side: of each point as `ring` numbers them, shape (n,).
        low: lower corner of the window, shape (2,).
        high: upper corner, shape (2,).
        goal: outside, shape (2,).
    """
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    faces = np.array([goal[1] < low[1], goal[0] > high[0], goal[1] > high[1], goal[0] < low[0]])
    left = np.full(4, np.inf)  # from each corner
    for k in range(4):
        if faces[k] or faces[k - 1]:  # the sides that meet there; before the first is the last
            left[k] = np.hypot(corners[k, 0] - goal[0], corners[k, 1] - goal[1])
    for _ in range(2):  # no corner is farther than two edges from one that sees the goal
        before = left.copy()
        for k in range(4):
            after = (k + 1) % 4  # side k, from corner k to that after it
            edge = np.hypot(corners[after, 0] - corners[k, 0], corners[after, 1] - corners[k, 1])
            left[k] = min(left[k], before[after] + edge)
            left[after] = min(left[after], before[k] + edge)
    remainder = np.empty(len(points))
    for i in range(len(points)):
        k, after = side[i], (side[i] + 1) % 4
        x, y = points[i, 0], points[i, 1]
        if faces[k]:
            remainder[i] = np.hypot(x - goal[0], y - goal[1])
        else:
            back = np.hypot(x - corners[k, 0], y - corners[k, 1]) + left[k]
            remainder[i] = min(back, np.hypot(x - corners[after, 0], y - corners[after, 1]) + left[after])
    return remainder
