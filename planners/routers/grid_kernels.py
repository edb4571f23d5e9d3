"""Pulling the staircase of a grid path straight, and the cells along one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
Bool = NDArray[np.bool_]


@kernel()
def segment_cost(cost: F64, x0: float, y0: float, x1: float, y1: float) -> float:
    """Return the integral of the cost, shape (rows, columns), along a segment in cells (cell (0, 0) has its centre at 0, 0)."""
    length = np.hypot(x1 - x0, y1 - y0)
    pieces = max(1, int(np.ceil(2.0 * length)))
    total = 0.0
    for i in range(pieces):
        part = (i + 0.5) / pieces
        row = min(max(int(np.floor(y0 + part * (y1 - y0) + 0.5)), 0), cost.shape[0] - 1)
        column = min(max(int(np.floor(x0 + part * (x1 - x0) + 0.5)), 0), cost.shape[1] - 1)
        total += cost[row, column]
    return float(total * length / pieces)


@kernel()
def pull_straight(path: F64, cost: F64) -> F64:
    """Return the path from cell to cell, (n, 2) as x, y, with every detour replaced by a segment that costs no more, (m, 2).

    Greedy from the start, the farthest segment first, as the path smoothing of A* (Thorpe, 1984; Daniel et al., Theta*,
    JAIR 2010), but comparing cost instead of mere visibility, so that the clearance the search paid for is kept.
    """
    n = len(path)
    along = np.zeros(n)
    for i in range(1, n):  # from cell to cell, as the search counts it: halfway on a diagonal lies a cell that may be blocked
        joined = cost[int(path[i - 1, 1]), int(path[i - 1, 0])] + cost[int(path[i, 1]), int(path[i, 0])]
        along[i] = along[i - 1] + 0.5 * joined * np.hypot(path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1])
    kept = np.zeros(n, dtype=np.int64)
    count, here = 1, 0
    while here < n - 1:
        there = n - 1
        while there > here + 1:
            straight = segment_cost(cost, path[here, 0], path[here, 1], path[there, 0], path[there, 1])
            if straight <= along[there] - along[here] + 1e-9:
                break
            there -= 1
        kept[count] = there
        count += 1
        here = there
    return path[kept[:count]]


@kernel()
def near_cells(path_rows: I64, path_columns: I64, reach: int, rows: int, columns: int) -> Bool:
    """Return which cells lie within `reach` cells, up or across, of a cell of the path, (n,) each; shape (rows, columns)."""
    near = np.zeros((rows, columns), np.bool_)
    for i in range(len(path_rows)):
        for row in range(max(path_rows[i] - reach, 0), min(path_rows[i] + reach + 1, rows)):
            for column in range(max(path_columns[i] - reach, 0), min(path_columns[i] + reach + 1, columns)):
                near[row, column] = True
    return near
