"""Random numbers for scenarios: drawn once and used again; a smaller and a larger count share theirs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drivers.interface.seeds import stream
from estimators.belief import F32


class Chance:
    """Standing draws, each named: asked for again they are the same, and those for more scenarios or rows begin with the fewer.

    It holds nothing but what follows from its arguments, so that it is no state.

    >>> few, many = (Chance(1, "doctest").normal("start", 2, 3, n) for n in (4, 9))
    >>> bool((many[:, :, :4] == few).all())
    True
    """

    def __init__(self, seed: int, consumer: str, tick: int = 0) -> None:
        """Begin with nothing drawn; whoever wants other numbers at every tick makes one for each."""
        self._seed, self._consumer, self._tick = seed, consumer, tick
        self._blocks: dict[tuple[str, int], F32] = {}  # name, row: (scenarios, width), the most that were asked for
        self._last: dict[str, F32] = {}

    def normal(self, name: str, rows: int, width: int, scenarios: int) -> F32:
        """Return standard normal numbers, shape (rows, width, scenarios); not to be written to."""
        return self._draws(name, (rows, width, scenarios), lambda rng, shape: rng.standard_normal(shape, np.float32))

    def uniform(self, name: str, rows: int, scenarios: int) -> F32:
        """Return numbers in [0, 1), shape (rows, 1, scenarios); not to be written to."""
        return self._draws(name, (rows, 1, scenarios), lambda rng, shape: rng.random(shape, np.float32))

    def _draws(self, name: str, shape: tuple[int, int, int], draw: Callable[[np.random.Generator, tuple[int, int]], F32]) -> F32:
        last = self._last.get(name)
        if last is not None and last.shape == shape:
            return last
        rows, width, scenarios = shape
        drawn = np.empty(shape, np.float32)
        for row in range(rows):
            block = self._blocks.get((name, row))
            if block is None or len(block) < scenarios or block.shape[1] != width:
                rng = stream(self._seed, f"{self._consumer} {name} {row}", self._tick)
                block = self._blocks[name, row] = draw(rng, (scenarios, width))
            drawn[row] = block[:scenarios].T
        self._last[name] = drawn
        return drawn
