"""When cells were seen occupied, and which of them a component has left."""

from __future__ import annotations

import math
from typing import Any

from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import FREE, OCCUPIED, U8

I64 = NDArray[Any]


@kernel()
def count_left(label: U8, component: I64, seen_ns: I64, oldest_ns: int, left: I64) -> None:
    """Count the cells that each component has left, into `left`, shape (components + 1,).

    Left is a cell that was seen occupied at or after `oldest_ns`, and beside which nothing stands now: a free one two cells
    from the component, or one that is not seen, behind the component as the sensor in the lattice's middle sees it.
    """
    rows, columns = label.shape
    for row in range(3, rows - 3):
        for column in range(3, columns - 3):
            if seen_ns[row, column] < oldest_ns or _stands(label, row, column, 1):
                continue
            if label[row, column] == FREE:
                left[_component_around(label, component, row, column)] += 1
                continue
            y, x = 0.5 * rows - row - 0.5, 0.5 * columns - column - 0.5
            length = math.hypot(x, y) + 1e-9
            for step in (2.0, 3.0):
                at = row + round(step * y / length), column + round(step * x / length)
                if label[at] == OCCUPIED:
                    left[component[at]] += 1
                    break
    left[0] = 0


@kernel()
def _stands(label: U8, row: int, column: int, reach: int) -> bool:
    for i in range(row - reach, row + reach + 1):
        for j in range(column - reach, column + reach + 1):
            if label[i, j] == OCCUPIED:
                return True
    return False


@kernel()
def _component_around(label: U8, component: I64, row: int, column: int) -> int:
    for i in range(row - 2, row + 3):
        for j in range(column - 2, column + 3):
            if label[i, j] == OCCUPIED:
                return int(component[i, j])
    return 0


@kernel()
def keep_times(label: U8, seen_ns: I64, since_ns: I64, now_ns: int, oldest_ns: int, never_ns: int) -> None:
    """Note when cells are occupied, and since when; one that was seen free, or not occupied since `oldest_ns`, begins anew."""
    for row in range(label.shape[0]):
        for column in range(label.shape[1]):
            at = row, column
            if label[at] == OCCUPIED:
                if since_ns[at] == never_ns:
                    since_ns[at] = now_ns
                seen_ns[at] = now_ns
            elif label[at] == FREE or seen_ns[at] < oldest_ns:
                since_ns[at] = never_ns
