"""What the viewer shows of a decision, gathered from its arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]


@kernel()
def first_conflict(x: F32, y: F32, futures: F32, contact: F32, count: int) -> int:
    """Return the first step at which a motion of shape (steps,) touches an obstacle in `count` scenarios or more; -1: never."""
    steps, obstacles, _, n = futures.shape
    hit = np.zeros(n, np.bool_)
    for k in range(steps):
        for m in range(obstacles):
            for i in range(n):
                dx, dy = futures[k, m, 0, i] - x[k], futures[k, m, 1, i] - y[k]
                hit[i] |= dx * dx + dy * dy < contact[m] * contact[m]
        if hit.sum() >= count:
            return k
    return -1


@kernel()
def by_conjecture(
    position: F32, which: NDArray[np.int64], conjectures: int, every: int, shown: int
) -> tuple[F64, NDArray[np.int64]]:
    """Return every so many steps of the first scenarios, shape (dots, 2), ordered by conjecture, and where each one's end."""
    steps, obstacles, _, n = position.shape
    n = min(n, shown)
    dots, edges = np.empty((steps // every * obstacles * n, 2)), np.zeros(conjectures + 1, np.int64)
    at = 0
    for c in range(conjectures):
        for m in range(obstacles):
            for i in range(n):
                if which[m, i] == c:
                    for k in range(every - 1, steps, every):
                        dots[at, 0], dots[at, 1] = position[k, m, 0, i], position[k, m, 1, i]
                        at += 1
        edges[c + 1] = at
    return dots, edges


@kernel()
def by_objective(x: F32, y: F32, objective: F64, free: NDArray[np.bool_], limits: F64) -> tuple[F64, NDArray[np.int64]]:
    """Return the ends of the motions, shape (commands, 2), the free ones by the first of the limits, which fall, that their
    objective reaches, then the others; and the edges of these groups, shape (limits + 2,).
    """
    count, groups, last = len(objective), len(limits) + 1, x.shape[1] - 1
    ends, edges, at = np.empty((count, 2)), np.zeros(groups + 1, np.int64), 0
    for group in range(groups):
        for u in range(count):
            own = 0
            while own < groups - 1 and (not free[u] or objective[u] < limits[own]):
                own += 1
            if own == group:
                ends[at, 0], ends[at, 1] = x[u, last], y[u, last]
                at += 1
        edges[group + 1] = at
    return ends, edges
