"""Tail risk of sampled losses, and how far a finite sample may be from the truth.

CVaR is meant by its *tail fraction* alpha: the mean of the worst alpha of all outcomes; alpha = 1 is the mean, alpha -> 0 the
worst.  Who speaks of a confidence level beta means alpha = 1 - beta.

Source: Han, Zhu, RCSP: Risk-Sensitive Conjectural Scenario Planning for Safe Dynamic Robot Navigation, section 4.3 and
appendices C.2, C.3; Rockafellar, Uryasev, Optimization of conditional value-at-risk, Journal of Risk 2, 2000.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

F64 = NDArray[np.float64]

_ROUNDING = 1e-9  # 0.07 * 100 is 7.000000000000001, and still makes a tail of seven


def tail_count(samples: int, tail_fraction: float) -> int:
    """Return how many of the samples make up the tail, the fraction rounded up; at least one.

    Raises:
        ValueError: there are no samples, or the fraction is not in (0, 1].

    >>> tail_count(128, 0.1), tail_count(100, 0.07), tail_count(5, 0.01)
    (13, 7, 1)
    """
    _check(samples, tail_fraction)
    return max(1, math.ceil(tail_fraction * samples - _ROUNDING))


def cvar(losses: F64, tail_fraction: float) -> float:
    """Return the mean of the ceil(alpha N) largest of the losses, shape (n,): the estimator of algorithm 1.

    Raises:
        ValueError: there are no losses, or the fraction is not in (0, 1].

    >>> cvar(np.array([1.0, 5.0, 3.0, 2.0]), 0.3)
    4.0
    """
    count = tail_count(len(losses), tail_fraction)
    return float(np.partition(losses, len(losses) - count)[len(losses) - count :].mean())


def fractional_cvar(losses: F64, tail_fraction: float) -> float:
    """Return the CVaR of the empirical distribution itself, where the last of the tail counts by the fraction it is in it.

    It is the infimum over eta of eta + E[(X - eta)+] / alpha (appendix C.3) with the samples equally likely.

    Raises:
        ValueError: there are no losses, or the fraction is not in (0, 1].

    >>> fractional_cvar(np.array([1.0, 5.0, 3.0, 2.0]), 0.375)  # (5 + 3 / 2) / 1.5
    4.333333333333333
    """
    _check(len(losses), tail_fraction)
    worst_first = np.sort(losses)[::-1]
    weights = np.clip(tail_fraction * len(losses) - np.arange(len(losses)), 0.0, 1.0)
    return float(weights @ worst_first / (tail_fraction * len(losses)))


def cvar_error(samples: int, tail_fraction: float, loss_bound: float, commands: int, delta: float) -> float:
    """Return what the empirical CVaR of any of the commands misses the true one by at most, with probability 1 - delta.

    Source: proposition C.2.  Losses lie in [0, loss_bound]; the bound holds for the fractional form, and for the rounded one
    where alpha N is whole.

    Raises:
        ValueError: a count is not positive, or a fraction is not in (0, 1].
    """
    _check(samples, tail_fraction)
    _check(commands, delta)
    return loss_bound / tail_fraction * math.sqrt(math.log(2.0 * commands / delta) / (2.0 * samples))


def objective_error(
    samples: int, tail_fraction: float, loss_bound: float, reward_range: float, weight: float, commands: int, delta: float
) -> float:
    """Return epsilon_N(delta): what mean reward - weight * CVaR of any command is off by at most, with probability 1 - delta.

    Source: proposition C.3.  The command that is best by the sample is then at most twice this worse than the best.

    Raises:
        ValueError: a count is not positive, or a fraction is not in (0, 1].
    """
    _check(samples, tail_fraction)
    _check(commands, delta)
    scale = reward_range + weight * loss_bound / tail_fraction
    return scale * math.sqrt(math.log(4.0 * commands / delta) / (2.0 * samples))


def _check(count: int, fraction: float) -> None:
    if count < 1 or not 0.0 < fraction <= 1.0:
        raise ValueError(f"it takes at least one sample and a fraction in (0, 1], not {count} and {fraction:g}")


_FEW = 40  # up to so many are gathered by insertion, which takes their square


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def gather_smallest(values: NDArray[np.float32], count: int) -> None:
    """Reorder values, shape (n,), so that the `count` smallest come first."""
    if count > _FEW:
        _partition(values, count)
        return
    for i in range(1, len(values)):
        value = values[i]
        if i >= count and value >= values[count - 1]:
            continue
        j = i
        if i >= count:
            j = count - 1
            values[i] = values[j]
        while j > 0 and values[j - 1] > value:
            values[j] = values[j - 1]
            j -= 1
        values[j] = value


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _partition(values: NDArray[np.float32], count: int) -> None:
    """Do the same by quickselect: in no particular order, but in time that grows with n alone.

    Source: Hoare, Algorithm 65: Find, Communications of the ACM 4(7), 1961; the middle of three as pivot.
    """
    low, high = 0, len(values) - 1
    while low < high:
        a, b, c = values[low], values[(low + high) // 2], values[high]
        pivot = max(min(a, b), min(max(a, b), c))
        i, j = low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if count - 1 <= j:
            high = j
        elif count - 1 >= i:
            low = i
        else:
            return
