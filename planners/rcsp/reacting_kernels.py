"""Clearances where every obstacle reacts to each command: its futures are made anew for each.

Source: Han, Zhu, RCSP, section 4.1; that the reaction may be to each candidate is ours.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from planners.prediction.kernels import Draws, advance
from planners.rcsp.clearance_kernels import lower_clearance, nearest_squared

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]


@kernel()
def reacting_clearances(x: F32, y: F32, draws: Draws, steps_s: F64, far_m: float) -> F32:
    """Return the least clearance of each command in each scenario over the horizon, shape (commands, scenarios)."""
    obstacles, _, n = draws.position.shape
    steps = len(steps_s)
    clearance = np.full((len(x), n), np.float32(far_m))
    own, best, robot = np.empty((steps, 2, n), np.float32), np.empty(n, np.float32), np.empty((steps, 2), np.float32)
    all_steps = np.arange(steps)
    for u in range(len(x)):
        robot[:, 0], robot[:, 1] = x[u], y[u]
        for m in range(obstacles):
            advance(draws, m, steps_s, robot, own)
            reach = draws.contact_m[m] + np.float32(far_m)
            best[:] = reach * reach
            nearest_squared(x[u], y[u], own, all_steps, best)
            lower_clearance(best, draws.contact_m[m], clearance[u])
    return clearance
