"""The mean of few runs and how far to trust it, by resampling (Efron, Tibshirani, An introduction to the bootstrap, 1993)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import bootstrap

from drivers.interface.seeds import stream

RESAMPLES = 10_000
CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean, its percentile interval at 95 %, and the share of resampled means that are not above zero."""

    mean: float
    low: float
    high: float
    not_above_zero: float


def estimate_mean(values: Sequence[float]) -> Estimate:
    """Return mean and interval of at least one value; the same values give the same interval.

    >>> estimate_mean([1.0, 1.0, 1.0])
    Estimate(mean=1.0, low=1.0, high=1.0, not_above_zero=0.0)
    """
    sample = np.asarray(values, dtype=np.float64)
    mean = float(sample.mean())
    if np.ptp(sample) == 0.0:  # nothing to resample
        return Estimate(mean, mean, mean, float(mean <= 0.0))
    result = bootstrap(
        (sample,),
        np.mean,
        n_resamples=RESAMPLES,
        batch=1000,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=stream(0, "bootstrap"),
    )
    low, high = result.confidence_interval
    return Estimate(mean, float(low), float(high), float(np.mean(result.bootstrap_distribution <= 0.0)))
