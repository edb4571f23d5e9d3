"""From the cells of a frame to its connected components and back, in one pass each."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from estimators.belief import Mask

Components = NDArray[Any]  # (rows, columns) int32, of each cell the component's number
I64 = NDArray[np.int64]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def sizes(component: Components, cells: Mask, count: int) -> I64:
    """Return how many of some cells, shape (rows, columns), each component has, shape (count,)."""
    size = np.zeros(count, np.int64)
    for row in range(cells.shape[0]):
        for column in range(cells.shape[1]):
            if cells[row, column]:
                size[component[row, column]] += 1
    return size


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def cells_of(component: Components, chosen: Mask) -> Mask:
    """Return the cells, shape (rows, columns), of the components that are chosen, shape (count,)."""
    cells = np.empty(component.shape, np.bool_)
    for row in range(component.shape[0]):
        for column in range(component.shape[1]):
            cells[row, column] = chosen[component[row, column]]
    return cells
