"""What the viewer shows of a decision: candidates by their objective, sampled futures by conjecture, where it would commit."""

from __future__ import annotations

import numpy as np

from estimators.belief import F32
from planners.planner import Drawing, no_path
from planners.rcsp.drawing_kernels import by_conjecture, by_objective, first_conflict
from planners.rcsp.evaluation import Evaluation
from planners.velocity_lattice import Rollouts

EVERY = 5  # steps between two dots
SHOWN = 16  # scenarios of which the futures are drawn
GROUPS = ("candidates_good", "candidates_fair", "candidates_poor", "candidates_blocked")


def commitment_step(rolled: Rollouts, command: int, position: F32, contact: F32, tail: int) -> int:
    """Return the step before which a command touches an obstacle in a tail of the scenarios; -1: it does not."""
    if position.shape[3] == 0 or position.shape[1] == 0:
        return -1
    return int(first_conflict(rolled.x[command], rolled.y[command], position, contact, tail))


def drawn(rolled: Rollouts, told: Evaluation, names: tuple[str, ...], keenest: int, commitment: int) -> tuple[Drawing, ...]:
    """Return the layers: dots along candidates in thirds of their objective, dots of futures, the point of no return."""
    falling, third = np.sort(told.objective)[::-1], len(told.objective) // 3
    limits = np.array((falling[third - 1], falling[2 * third - 1], -np.inf))
    ends, parts = by_objective(rolled.x, rolled.y, told.objective, told.free, limits)
    candidates = [Drawing(name, ends[parts[k] : parts[k + 1]], connected=False) for k, name in enumerate(GROUPS)]
    dots, edges = by_conjecture(told.futures.position_in_odom, told.futures.conjecture, len(names), EVERY, SHOWN)
    futures = [Drawing(f"futures_{name}", dots[edges[k] : edges[k + 1]], connected=False) for k, name in enumerate(names)]
    point = no_path()
    if commitment >= 0:
        at = max(commitment - 1, 0)
        point = np.array([[rolled.x[keenest, at], rolled.y[keenest, at]]], np.float64)
    return (*candidates, *futures, Drawing("commitment", point, connected=False))
