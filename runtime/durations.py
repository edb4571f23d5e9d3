"""Statistics of how long the stages took, over runs of any length: what it holds does not grow with the ticks."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

PER_OCTAVE = 64  # classes from one duration to its double: each is 1.1 % wide
OCTAVES = 40  # up to 18 minutes
BLOCK = 1024  # ticks that are counted together


class Durations:
    """Mean and maximum exactly, percentiles to one per cent, from a histogram of logarithmic classes.

    >>> durations = Durations(stages=1)
    >>> for ns in range(1_000_000, 2_000_001, 1000):
    ...     durations.add((ns,))
    >>> len(durations), float(durations.mean_ns[0]), int(durations.max_ns[0])
    (1001, 1500000.0, 2000000)
    >>> round(float(durations.percentile_ns(50.0)[0]) / 1.5e6, 2)
    1.0
    """

    def __init__(self, stages: int) -> None:
        """Start with no tick."""
        self._block: list[tuple[int, ...]] = []
        self._counts = np.zeros((stages, PER_OCTAVE * OCTAVES), dtype=np.int64)
        self._sum_ns = np.zeros(stages, dtype=np.int64)
        self._max_ns = np.zeros(stages, dtype=np.int64)
        self._ticks = 0

    def add(self, durations_ns: tuple[int, ...]) -> None:
        """Take in one tick."""
        self._block.append(durations_ns)
        if len(self._block) == BLOCK:
            self._fold()

    def _fold(self) -> None:
        if not self._block:
            return
        block_ns = np.array(self._block, dtype=np.int64)  # (ticks, stages)
        classes = np.minimum(np.log2(np.maximum(block_ns, 1)) * PER_OCTAVE, PER_OCTAVE * OCTAVES - 1).astype(np.intp)
        np.add.at(self._counts, (np.arange(block_ns.shape[1]), classes), 1)
        self._sum_ns += block_ns.sum(axis=0)
        self._max_ns = np.maximum(self._max_ns, block_ns.max(axis=0))
        self._ticks += len(self._block)
        self._block.clear()

    def __len__(self) -> int:
        """Return the number of ticks."""
        return self._ticks + len(self._block)

    @property
    def mean_ns(self) -> NDArray[np.float64]:
        """The means, shape (stages,)."""
        self._fold()
        return np.asarray(self._sum_ns / max(self._ticks, 1))

    @property
    def max_ns(self) -> NDArray[np.int64]:
        """The longest, shape (stages,)."""
        self._fold()
        return self._max_ns

    def percentile_ns(self, percent: float) -> NDArray[np.float64]:
        """Return what so many per cent of the ticks do not exceed, shape (stages,): the middle of its class."""
        self._fold()
        rank = max(math.ceil(self._ticks * percent / 100.0), 1)
        index = (np.cumsum(self._counts, axis=1) < rank).sum(axis=1)
        return np.asarray(np.minimum(np.exp2((index + 0.5) / PER_OCTAVE), self._max_ns))
