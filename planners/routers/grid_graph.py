"""An eight-connected grid as a sparse graph, searched by SciPy; only the weights change from call to call."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

_STEPS = ((0, 1), (1, 0), (1, 1), (1, -1))  # each edge once; its reverse follows


class GridGraph:
    """Cells are nodes, numbered row by row; an edge costs its length times the mean cost of the two cells it joins."""

    def __init__(self, rows: int, columns: int, cell_m: float) -> None:
        """Lay out the edges once (compressed sparse rows)."""
        self.shape = (rows, columns)
        node = np.arange(rows * columns, dtype=np.int32).reshape(self.shape)
        tails, heads, lengths = [], [], []
        for down, right in _STEPS:
            a = node[: rows - down, max(0, -right) : columns - max(0, right)].ravel()
            b = node[down:, max(0, right) : columns - max(0, -right)].ravel()
            tails += [a, b]
            heads += [b, a]
            lengths += [np.full(2 * a.size, cell_m * np.hypot(down, right))]
        tail, head = np.concatenate(tails), np.concatenate(heads)
        order = np.lexsort((head, tail))
        self._tail, self._head = tail[order], head[order]
        self._half_length = 0.5 * np.concatenate(lengths)[order]
        row_start = np.searchsorted(self._tail, np.arange(rows * columns + 1)).astype(np.int32)
        self._graph = csr_array((self._half_length.copy(), self._head, row_start), shape=(rows * columns, rows * columns))

    def search(self, cost: F64, start: int) -> tuple[F64, I32]:
        """Return the cheapest cost from `start` to every node and each node's predecessor, shapes (nodes,).

        Args:
            cost: per cell, shape (rows, columns), positive; infinite where there is no way.
            start: node number.
        """
        weigh(cost.ravel(), self._tail, self._head, self._half_length, self._graph.data)
        distance, predecessor = dijkstra(self._graph, directed=True, indices=[start], return_predecessors=True)
        return distance[0], np.asarray(predecessor[0], dtype=np.int32)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def weigh(cost: F64, tail: I32, head: I32, half_length: F64, weight: F64) -> None:
    """Write the weight of every edge, shape (edges,), from the cost of every node, shape (nodes,)."""
    for edge in range(len(weight)):
        weight[edge] = (cost[tail[edge]] + cost[head[edge]]) * half_length[edge]


def trace(predecessor: I32, target: int) -> list[int]:
    """Return the nodes from the start of the search to `target`."""
    nodes = [target]
    while predecessor[nodes[-1]] >= 0:
        nodes.append(int(predecessor[nodes[-1]]))
    return nodes[::-1]
