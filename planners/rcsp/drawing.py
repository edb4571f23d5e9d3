"""What the viewer shows of a decision: candidates by their objective, sampled futures by conjecture, where it would commit."""

from __future__ import annotations

import numpy as np

from estimators.belief import F32
from planners.planner import Drawing, no_path
from planners.rcsp.evaluation import Evaluation
from planners.rcsp.kernels import first_conflict
from planners.velocity_lattice import Rollouts

EVERY = 5  # steps between two dots
SHOWN = 24  # scenarios of which the futures are drawn
GROUPS = ("candidates_good", "candidates_fair", "candidates_poor", "candidates_blocked")


def commitment_step(rolled: Rollouts, command: int, position: F32, contact: F32, tail: int) -> int:
    """Return the step before which a command touches an obstacle in a tail of the scenarios; -1: it does not."""
    if position.shape[3] == 0 or position.shape[1] == 0:
        return -1
    return int(first_conflict(rolled.x[command], rolled.y[command], position, contact, tail))


def drawn(rolled: Rollouts, told: Evaluation, names: tuple[str, ...], keenest: int, commitment: int) -> tuple[Drawing, ...]:
    """Return the layers: dots along candidates in thirds of their objective, dots of futures, the point of no return."""
    ends = np.stack((rolled.x[:, EVERY - 1 :: EVERY], rolled.y[:, EVERY - 1 :: EVERY]), axis=2).astype(np.float64)
    low, high = np.quantile(told.objective, (1.0 / 3.0, 2.0 / 3.0))
    rank = np.where(told.objective >= high, 0, np.where(told.objective >= low, 1, 2))
    rank[~told.free] = 3
    candidates = [Drawing(name, ends[rank == k].reshape(-1, 2), connected=False) for k, name in enumerate(GROUPS)]
    point = no_path()
    if commitment >= 0:
        at = max(commitment - 1, 0)
        point = np.array([[rolled.x[keenest, at], rolled.y[keenest, at]]], np.float64)
    return (*candidates, *_futures(told, names), Drawing("commitment", point, connected=False))


def _futures(told: Evaluation, names: tuple[str, ...]) -> list[Drawing]:
    """Return the futures of the first scenarios, by conjecture."""
    position = told.futures.position_in_odom[EVERY - 1 :: EVERY, :, :, :SHOWN]
    points = np.moveaxis(position, 2, 3)  # (steps, obstacles, scenarios, 2)
    which = told.futures.conjecture[:, :SHOWN]
    return [
        Drawing(f"futures_{name}", points[:, which == index].reshape(-1, 2).astype(np.float64), connected=False)
        for index, name in enumerate(names)
    ]
