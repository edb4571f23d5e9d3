"""Compares two runs, simulated against real or before against after: distributions of time, error, effort and clearance."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Column, Table
from scipy.stats import ks_2samp

from drivers.interface.seeds import stream
from runtime.quantities import Quantity, quantities

HEAD = ("quantity", "", "median", "worst 5%", "1%", "worst", "B - A, 95%", "gap")
_RESAMPLES = 400
_FEWEST = 20  # values, below which no interval is given
F64 = NDArray[np.float64]
Pair = tuple[Quantity | None, Quantity | None]  # of A and B


@dataclass(frozen=True, slots=True)
class Summary:
    """One quantity in one log.  The worst are its greatest values, of clearance its least: p95, p99, max or p5, p1, min."""

    values: int
    median: float
    worst_5_percent: float
    worst_1_percent: float
    worst: float


@dataclass(frozen=True, slots=True)
class Difference:
    """How B stands to A in one quantity."""

    median: float  # B's less A's
    interval: tuple[float, float] | None  # of the median's, 95 %; none where the values of a run are one draw, not many
    gap: float  # Kolmogorov and Smirnov's: the largest gap between the two distribution functions, 0 to 1


@dataclass(frozen=True, slots=True)
class Comparison:
    """One quantity in both logs; None: a log does not have it."""

    name: str
    unit: str
    a: Summary | None
    b: Summary | None
    difference: Difference | None

    def rows(self) -> list[tuple[str, ...]]:
        """Return the texts of the table's rows, in the order of HEAD."""
        d, interval = self.difference, self.difference.interval if self.difference else None
        apart = ("", "") if d is None else (f"{d.median:+.3g}", f"{d.gap:.2f}")
        within = "" if interval is None else f"{interval[0]:+.2g} .. {interval[1]:+.2g}"
        return [
            (f"{self.name} [{self.unit}]", "A", *_cells(self.a), *apart),
            ("", "B", *_cells(self.b), within, ""),
        ]


def compare(log_a: Path, log_b: Path) -> tuple[tuple[Comparison, ...], dict[str, Pair]]:
    """Return the comparison of every quantity that either log has, and the values behind it by the quantity's name.

    Raises:
        ConfigurationError: a file is not a log of ours, damaged, or holds no tick.
    """
    a, b = quantities(log_a), quantities(log_b)
    pairs = {name: (a.get(name), b.get(name)) for name in {**a, **b}}
    return tuple(compared(name, one, other) for name, (one, other) in pairs.items()), pairs


def compared(name: str, a: Quantity | None, b: Quantity | None) -> Comparison:
    """Compare one quantity."""
    known = a or b
    assert known is not None
    return Comparison(name, known.unit, summary(a), summary(b), difference(name, a, b) if a and b else None)


def summary(quantity: Quantity | None) -> Summary | None:
    """Return median and tail; percentiles are linear between the values."""
    if quantity is None:
        return None
    ranks = (50, 5, 1, 0) if quantity.low_is_bad else (50, 95, 99, 100)
    return Summary(len(quantity.values), *(float(value) for value in np.percentile(quantity.values, ranks)))


def difference(name: str, a: Quantity, b: Quantity) -> Difference:
    """Return how B stands to A.  An interval only where a run's values are many draws of one distribution, not one path."""
    interval = None
    if a.repeats and b.repeats and min(len(a.values), len(b.values)) >= _FEWEST:
        low, high = np.percentile(
            block_medians(b.values, f"compare.{name}.b") - block_medians(a.values, f"compare.{name}.a"), (2.5, 97.5)
        )
        interval = (float(low), float(high))
    gap = float(ks_2samp(a.values, b.values, method="asymp").statistic)
    return Difference(float(np.median(b.values) - np.median(a.values)), interval, gap)


def block_medians(values: F64, consumer: str) -> F64:
    """Return medians of resampled series, shape (resamples,), by the moving-block bootstrap.

    Neighbouring ticks resemble each other, so blocks of n^(1/3) values are drawn and not single ones.
    Source: Kuensch, The jackknife and the bootstrap for general stationary observations, Annals of Statistics 17, 1989.
    """
    count = len(values)
    length = math.ceil(count ** (1 / 3))
    starts = stream(0, consumer).integers(0, count - length + 1, size=(_RESAMPLES, math.ceil(count / length)))
    within = np.arange(length)
    return np.array([np.median(values[(row[:, None] + within).ravel()[:count]]) for row in starts])


def table(comparisons: tuple[Comparison, ...], log_a: Path, log_b: Path) -> Table:
    """Return the comparison for the terminal."""
    columns = [Column(name, no_wrap=True) for name in HEAD]
    drawn = Table(*columns, title=f"A: {log_a}\nB: {log_b}", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for comparison in comparisons:
        for row in comparison.rows():
            drawn.add_row(*(escape(text) for text in row))
    return drawn


def markdown(comparisons: tuple[Comparison, ...], log_a: Path, log_b: Path) -> str:
    """Return the comparison as a Markdown table."""
    lines = [f"A: `{log_a}`, B: `{log_b}`", "", "| " + " | ".join(HEAD) + " |", "|---" * len(HEAD) + "|"]
    lines += ["| " + " | ".join(row) + " |" for comparison in comparisons for row in comparison.rows()]
    return "\n".join(lines) + "\n"


def as_json(comparisons: tuple[Comparison, ...], log_a: Path, log_b: Path) -> str:
    """Return the comparison as JSON."""
    found = {"a": str(log_a), "b": str(log_b), "quantities": [asdict(comparison) for comparison in comparisons]}
    return json.dumps(found, indent=2, allow_nan=False) + "\n"


def _cells(found: Summary | None) -> tuple[str, ...]:
    if found is None:
        return ("none", "", "", "")
    return tuple(f"{value:.3g}" for value in (found.median, found.worst_5_percent, found.worst_1_percent, found.worst))
