"""From the cells of a frame to its connected components and back, in one pass each."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import Mask

Components = NDArray[Any]  # (rows, columns) int32, of each cell the component's number
I64 = NDArray[np.int64]


@kernel()
def sizes(component: Components, cells: Mask, count: int) -> I64:
    """Return how many of some cells, shape (rows, columns), each component has, shape (count,)."""
    size = np.zeros(count, np.int64)
    for row in range(cells.shape[0]):
        for column in range(cells.shape[1]):
            if cells[row, column]:
                size[component[row, column]] += 1
    return size


@kernel()
def cells_of(component: Components, chosen: Mask) -> Mask:
    """Return the cells, shape (rows, columns), of the components that are chosen, shape (count,)."""
    cells = np.empty(component.shape, np.bool_)
    for row in range(component.shape[0]):
        for column in range(component.shape[1]):
            cells[row, column] = chosen[component[row, column]]
    return cells


@kernel()
def extents(component: Components, count: int) -> I64:
    """Return how many columns and rows each component spans, shape (count, 2); the background, which is the first, none."""
    low, high = np.full((count, 2), max(component.shape), np.int64), np.full((count, 2), -1, np.int64)
    for row in range(component.shape[0]):
        for column in range(component.shape[1]):
            one = component[row, column]
            if one > 0:
                low[one, 0], low[one, 1] = min(low[one, 0], column), min(low[one, 1], row)
                high[one, 0], high[one, 1] = max(high[one, 0], column), max(high[one, 1], row)
    high[0] = low[0] - 1
    return high - low + 1
