"""What a benchmark measures, and how the time of a call is measured."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

Case = tuple[str, Callable[[], object]]


@dataclass(frozen=True, slots=True)
class Figure:
    """One measured figure.  Of a distribution `value` is the median; `peer_*` is what the peer did in the same run."""

    name: str
    value: float
    p99: float | None = None
    unit: str = "ms"
    peer: str = ""
    peer_value: float | None = None
    peer_p99: float | None = None
    mean: float | None = None

    @property
    def ratio(self) -> float | None:
        """The median over the peer's, or None without a peer."""
        return self.value / self.peer_value if self.peer_value else None

    @property
    def p99_ratio(self) -> float | None:
        """The 99th percentile over the peer's, or None without one."""
        return self.p99 / self.peer_p99 if self.peer_p99 and self.p99 is not None else None


def of_distribution(name: str, values: Sequence[float], unit: str = "ms", peer: str = "", others: Sequence[float] = ()) -> Figure:
    """Return median, 99th percentile and mean of the values, and the first two of the peer's where there is one."""
    p50, p99 = (float(value) for value in np.percentile(values, (50, 99)))
    mean = float(np.mean(values))
    if not others:
        return Figure(name, p50, p99, unit, mean=mean)
    peer_p50, peer_p99 = (float(value) for value in np.percentile(others, (50, 99)))
    return Figure(name, p50, p99, unit, peer, peer_p50, peer_p99, mean)


def timed(name: str, call: Callable[[], object], peer: str = "", peer_call: Callable[[], object] | None = None) -> Figure:
    """Time a call [ms] after a warm-up: 200 times, or for a second if that comes first (but five times at least).

    A peer's call takes turns with ours, so that both meet the same disturbances.
    """
    calls = [call] if peer_call is None else [call, peer_call]
    elapsed_ms: list[list[float]] = [[] for _ in calls]
    for each in calls * 3:
        each()
    begun_ns = time.perf_counter_ns()
    repeats = 0
    while repeats < 5 or (repeats < 200 and time.perf_counter_ns() - begun_ns < len(calls) * 1_000_000_000):
        for each, times in zip(calls, elapsed_ms, strict=True):
            before_ns = time.perf_counter_ns()
            each()
            times.append((time.perf_counter_ns() - before_ns) * 1e-6)
        repeats += 1
    return of_distribution(name, elapsed_ms[0], "ms", peer, elapsed_ms[-1] if peer_call else ())
