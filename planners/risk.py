"""Tail risk of sampled losses, and how far a finite sample may be from the truth.

CVaR is meant by its *tail fraction* alpha: the mean of the worst alpha of all outcomes; alpha = 1 is the mean, alpha -> 0 the
worst.  Who speaks of a confidence level beta means alpha = 1 - beta.

Source: Han, Zhu, RCSP: Risk-Sensitive Conjectural Scenario Planning for Safe Dynamic Robot Navigation, section 4.3 and
appendices C.2, C.3; Rockafellar, Uryasev, Optimization of conditional value-at-risk, Journal of Risk 2, 2000.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

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


@kernel(fast=True)
def count_within(values: NDArray[np.float32], limit: np.float32) -> np.float32:
    """Return how many of the values, shape (n,), are at most the limit; counted in the type of the values, to be vectorised."""
    count, one, zero = np.float32(0.0), np.float32(1.0), np.float32(0.0)
    for i in range(len(values)):
        count += one if values[i] <= limit else zero
    return count


@kernel()
def extremes(values: NDArray[np.float32]) -> tuple[np.float32, np.float32]:
    """Return the least and the largest of values, shape (n,), n > 0; in four lanes, as each comparison waits for the last."""
    n = len(values)
    l0, l1, l2, l3 = values[0], values[0], values[0], values[0]
    h0, h1, h2, h3 = values[0], values[0], values[0], values[0]
    for i in range(0, n - 3, 4):
        a, b, c, d = values[i], values[i + 1], values[i + 2], values[i + 3]
        l0, l1, l2, l3 = a if a < l0 else l0, b if b < l1 else l1, c if c < l2 else l2, d if d < l3 else l3
        h0, h1, h2, h3 = a if a > h0 else h0, b if b > h1 else h1, c if c > h2 else h2, d if d > h3 else h3
    low, high = min(l0, l1, l2, l3), max(h0, h1, h2, h3)
    for i in range(n // 4 * 4, n):
        low, high = min(low, values[i]), max(high, values[i])
    return low, high


@kernel()
def gather_smallest(values: NDArray[np.float32], count: int, found: NDArray[np.float32]) -> None:
    """Write the `count` smallest of finite values, shape (n,), n at least count, into the front of `found`, shape (n + 1,).

    They come in the order in which they stand, those equal to the largest of them last.  It is found by bisection: counting is
    vectorised, where sorting guesses wrong at every other branch.
    """
    low, high = edge_of_smallest(values, count)
    if write_within(values, high, found) > count:  # several equal the largest
        found[write_within(values, low, found) : count] = high


@kernel()
def edge_of_smallest(values: NDArray[np.float32], count: int) -> tuple[np.float32, np.float32]:
    """Return a number below which or at which fewer than `count` of the values lie, and one where as many or more do.

    Either as many do, or no number lies between the two.  A value may be the least of all, and then no number is below.
    Zero, where bisection would go on through ever smaller numbers, is looked at first.
    """
    low, high = extremes(values)
    zero = np.float32(0.0)
    beneath = np.nextafter(zero, np.float32(-1.0))
    if low <= zero < high:
        low, high = (low, zero) if count_within(values, zero) >= count else (zero, high)
    if low < beneath < high == zero:
        low, high = (low, beneath) if count_within(values, beneath) >= count else (beneath, zero)
    while True:
        middle = np.float32(0.5) * (low + high)
        if not low < middle < high:
            return low, high
        within = count_within(values, middle)
        if within == count:
            return low, middle
        low, high = (middle, high) if within < count else (low, middle)


@kernel()
def write_within(values: NDArray[np.float32], limit: np.float32, found: NDArray[np.float32]) -> int:
    """Write values, shape (n,), that are at most the limit into the front of `found`, (n + 1,); return how many they are."""
    first = 0
    for i in range(len(values)):
        found[first] = values[i]
        first += values[i] <= limit
    return first
