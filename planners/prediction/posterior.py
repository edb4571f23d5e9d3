"""The stabilised posterior over conjectures: tempered, floored, and cut to its heaviest members for sampling.

Source: Han, Zhu, RCSP, algorithm 1 (line 3) and appendix A.
"""

from __future__ import annotations

import numpy as np

from drivers.interface.kernel import kernel
from estimators.belief import F64


@kernel()
def floored(weights: F64, floor: float) -> F64:
    """Return weights, shape (conjectures,), none of which is below the floor; the others keep their proportions.

    What is above the floor already is left alone: the floor is no forgetting, however often it is applied.

    >>> floored(np.array([0.7, 0.3, 0.0]), 0.1).round(3).tolist()
    [0.63, 0.27, 0.1]
    """
    raised = weights.copy()
    for _ in range(len(weights)):  # lowering the others may bring one of them below the floor
        low = raised <= floor
        share = (1.0 - floor * low.sum()) / max(raised[~low].sum(), 1e-300)
        raised = np.where(low, floor, share * raised)
        if not (raised < floor).any():
            break
    return raised


@kernel()
def updated(weights: F64, log_likelihood: F64, temperature: float, floor: float) -> F64:
    """Return q_t proportional to q_{t-1} l_t^(1/tau), then floored; shapes (rows, conjectures).

    >>> updated(np.array([[0.5, 0.5]]), np.log([[0.8, 0.2]]), 1.0, 0.0).round(3).tolist()
    [[0.8, 0.2]]
    """
    posterior = np.empty(weights.shape)
    for row in range(len(weights)):
        log_weights = np.log(np.maximum(weights[row], 1e-300)) + log_likelihood[row] / temperature
        raised = np.exp(log_weights - log_weights.max())
        posterior[row] = floored(raised / raised.sum(), floor)
    return posterior


@kernel()
def heaviest(weights: F64, count: int) -> F64:
    """Return weights, shape (rows, conjectures), with all but the `count` largest of a row zero and the rest summing to one.

    Of equals the earlier stays.

    >>> heaviest(np.array([[0.2, 0.5, 0.3]]), 2).round(3).tolist()
    [[0.0, 0.625, 0.375]]
    """
    kept = np.zeros(weights.shape)
    for row in range(len(weights)):
        total = 0.0
        for _ in range(min(count, weights.shape[1])):
            best = -1
            for c in range(weights.shape[1]):
                if kept[row, c] == 0.0 and (best < 0 or weights[row, c] > weights[row, best]):
                    best = c
            kept[row, best] = weights[row, best]
            total += weights[row, best]
        kept[row] /= total
    return kept
