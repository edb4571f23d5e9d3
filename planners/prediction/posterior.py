"""The stabilised posterior over conjectures: tempered, floored, and cut to its heaviest members for sampling.

Source: Han, Zhu, RCSP, algorithm 1 (line 3) and appendix A.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from estimators.belief import F64


def updated(weights: F64, log_likelihood: F64, temperature: float, floor: float) -> F64:
    """Return q_t proportional to q_{t-1} l_t^(1/tau), then floored; shapes (..., conjectures).

    >>> updated(np.array([0.5, 0.5]), np.log([0.8, 0.2]), 1.0, 0.0).round(3).tolist()
    [0.8, 0.2]
    """
    log_weights = np.log(np.maximum(weights, np.finfo(np.float64).tiny)) + log_likelihood / temperature
    raised = np.exp(log_weights - log_weights.max(axis=-1, keepdims=True))
    return floored(raised / raised.sum(axis=-1, keepdims=True), floor)


def floored(weights: F64, floor: float) -> F64:
    """Return weights none of which is below the floor: what they have above it is shared out in the same proportion.

    >>> floored(np.array([1.0, 0.0]), 0.1).tolist()
    [0.9, 0.1]
    """
    return np.asarray(floor + (1.0 - weights.shape[-1] * floor) * weights)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
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
