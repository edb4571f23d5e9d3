"""How an order reaches the process at the wire: the newest one only, with its number and its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interface.shared_memory import Block, Seqlock

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Order:
    """What is to be sent, once, and until when it holds on CLOCK_MONOTONIC.  No values: come to rest."""

    sequence: int  # counts from 1; a number that was acted on is never acted on again
    expires_ns: int
    values: F64  # (n,)


class CommandSlot:
    """Holds the newest order; the host writes, the child reads."""

    def __init__(self, block: Block, capacity: int) -> None:
        """Take the slot's place in the memory, for at most `capacity` values."""
        self._lock = Seqlock(block.words(1))
        self._words = block.words(4)  # sequence, expires_ns, count, resets asked for
        self._values: F64 = block.array(np.float64, capacity).view(np.float64)
        self._seen = self._lock.version
        self._newest = Order(0, 0, np.zeros(0))

    def write(self, values: F64, expires_ns: int) -> None:
        """Replace the order.

        Raises:
            ValueError: more values than the slot holds.
        """
        count = len(values)
        if count > len(self._values):
            raise ValueError(f"an order of {count} values does not fit into a slot of {len(self._values)}")
        self._lock.begin()
        self._values[:count] = values
        self._words[0] += 1
        self._words[1] = expires_ns
        self._words[2] = count
        self._lock.end()

    def read(self) -> Order:
        """Return the newest whole order; sequence 0 before the first."""
        version = self._lock.version
        if version != self._seen and (order := self._lock.read(self._copy)) is not None:
            self._newest, self._seen = order, version
        return self._newest

    @property
    def resets(self) -> int:
        """How often the operator has asked to clear the device's faults."""
        return int(self._words[3])

    def ask_reset(self) -> None:
        """Ask once more."""
        self._words[3] += 1

    def _copy(self) -> Order:
        return Order(int(self._words[0]), int(self._words[1]), self._values[: max(0, self._words[2])].copy())
