"""The distance field of equation 2 from the one there is: only what will be taken on arrival can lower it.

`Gamma_pred` is the distance to every cell that is occupied now or will be.  To those occupied now it is known already, so
the transform runs over the cells that will be taken only: a few, in a few columns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import F32, F64, U8

I64 = NDArray[np.int64]

FAR_CELLS = 30_000  # farther than any grid is long; its square fits into 32 bits


@kernel()
def lowered(clearance: F32, taken: U8, cell_m: float) -> F32:
    """Return the clearance [m] with the cells `taken` occupied as well, shape (rows, columns).

    Exact: where a taken cell is the nearest, the root of a whole number of squared cells, as `distance_to` gives it.

    Source: Felzenszwalb, Huttenlocher, Distance transforms of sampled functions, Theory of Computing 8, 2012: along the
    columns, then the lower envelope of one parabola for each column along every row.

    Args:
        clearance: distance to the cells occupied now [m], shape (rows, columns); what is not positive is occupied.
        taken: not 0 where a cell will be occupied, shape (rows, columns).
        cell_m: size of a cell.
    """
    out = np.maximum(clearance, np.float32(0.0))
    columns_of, along = distances_along(taken)
    if len(columns_of) == 0:
        return out
    rows, columns = taken.shape
    vertex, begin = np.empty(len(columns_of), np.int64), np.empty(len(columns_of) + 1)
    for row in range(rows):
        last = envelope(columns_of, along[:, row], vertex, begin)
        k = 0
        for column in range(columns):
            while k < last and begin[k + 1] < column:
                k += 1
            across, up = column - columns_of[vertex[k]], along[vertex[k], row]
            distance = np.sqrt(np.float32(across * across + up * up)) * np.float32(cell_m)
            out[row, column] = min(out[row, column], distance)
    return out


@kernel()
def distances_along(taken: U8) -> tuple[I64, I64]:
    """Return the columns with taken cells, shape (n,), and how far each of their cells is from one, shape (n, rows) [cells]."""
    rows, columns = taken.shape
    holds = np.zeros(columns, np.bool_)
    for row in range(rows):
        for k in range(columns):
            holds[k] |= taken[row, k] != 0
    columns_of = np.flatnonzero(holds)
    along = np.empty((len(columns_of), rows), np.int64)
    for i in range(len(columns_of)):
        column = columns_of[i]
        near = FAR_CELLS
        for row in range(rows):
            near = 0 if taken[row, column] != 0 else near + 1
            along[i, row] = near
        near = FAR_CELLS
        for row in range(rows - 1, -1, -1):
            near = 0 if taken[row, column] != 0 else near + 1
            along[i, row] = min(along[i, row], near)
    return columns_of, along


@kernel()
def envelope(columns_of: I64, along: I64, vertex: I64, begin: F64) -> int:
    """Find the lower envelope of parabolas (x - column)^2 + along^2; return the index of its last piece.

    Piece k belongs to the parabola `vertex[k]` and begins at `begin[k]`; both are filled in.
    """
    last = 0
    vertex[0], begin[0] = 0, -np.inf
    for i in range(1, len(columns_of)):
        at, height = columns_of[i], along[i] * along[i]
        while True:
            j = vertex[last]
            before = columns_of[j]
            meet = (at * at + height - before * before - along[j] * along[j]) / (2.0 * (at - before))
            if meet > begin[last]:
                break
            last -= 1
        last += 1
        vertex[last], begin[last] = i, meet
    return last
