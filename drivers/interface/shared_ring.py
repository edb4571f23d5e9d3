"""A ring of records between two processes: one writes, one reads, neither waits."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.shared_memory import Block, fence

Records = NDArray[np.void]


class SharedRing:
    """Fixed-size records; the writer never waits, so the oldest are overwritten, and the reader counts what it lost.

    The writer announces a record before it writes it (`_begun`) and after (`_done`).  What the reader has copied counts only if
    no announced record could have overwritten it meanwhile; so no record is ever seen half written.
    """

    def __init__(self, block: Block, dtype: np.dtype[Any], capacity: int) -> None:
        """Take the ring's place in the memory; a writer goes on where its predecessor stopped."""
        self._words = block.words(2)  # records done, records begun
        self._slots: Records = block.array(dtype, capacity)
        self._capacity = capacity
        self._read = 0
        self.overflowed = 0

    @property
    def written(self) -> int:
        """How many records were ever written."""
        return int(self._words[0])

    def put(self, record: tuple[Any, ...] | np.void) -> None:
        """Append one record."""
        index = self._words[0]
        self._words[1] = index + 1
        fence()
        self._slots[index % self._capacity] = record
        fence()
        self._words[0] = index + 1

    def skip(self) -> None:
        """Forget what was written until now; it was not lost, it was not wanted."""
        self._read = self.written

    def drain(self) -> Records:
        """Return every record since the last call, oldest first, shape (n,); a copy."""
        done = self._words[0]
        if done == self._read:
            return self._slots[:0].copy()
        first = max(self._read, done - self._capacity)
        fence()
        begin, end = first % self._capacity, (done - 1) % self._capacity + 1
        copied = self._slots[begin:end].copy() if begin < end else np.concatenate((self._slots[begin:], self._slots[:end]))
        fence()
        intact = min(max(first, self._words[1] - self._capacity), done)
        self.overflowed += intact - self._read
        self._read = done
        return copied[intact - first :]
