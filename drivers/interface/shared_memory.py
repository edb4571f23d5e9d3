"""Memory that two processes share: anonymous, so nothing is left behind however they die.

The memory is a `memfd`: it has no name, needs no tracker, and goes with the last process that holds it.
"""

from __future__ import annotations

import mmap
import os
import threading
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

T = TypeVar("T")

ALIGNMENT = 64  # a cache line, so that what one side writes does not slow down the other's reads
_LOCK = threading.Lock()


def fence() -> None:
    """Let every store before this be seen before every store after it, and every load likewise.

    Python has no fence of its own, and an ARM core may reorder plain stores.  To release a lock and to acquire one are
    ordered against each other and against all that stands before and after (ARMv8: store-release, then load-acquire).
    """
    for _ in range(2):
        _LOCK.acquire()
        _LOCK.release()


class Block:
    """A piece of memory that is handed out from its beginning; both sides take the same parts in the same order."""

    def __init__(self, buffer: mmap.mmap | None) -> None:
        """Start at the beginning; without a buffer it only counts."""
        self._buffer = buffer
        self.size = 0

    def words(self, count: int) -> memoryview:
        """Return int64 words, each of which is read and written in one piece."""
        return self.array(np.int64, count).data.cast("B").cast("q")

    def array(self, dtype: DTypeLike, count: int) -> NDArray[np.void]:
        """Return `count` items of a type, shape (count,)."""
        kind, start = np.dtype(dtype), self.size
        self.size = start + -(-kind.itemsize * count // ALIGNMENT) * ALIGNMENT
        if self._buffer is None:
            return np.zeros(count, kind)
        return np.frombuffer(self._buffer, kind, count, start)


def allocate(size: int) -> int:
    """Return the file descriptor of new shared memory, all zero."""
    descriptor = os.memfd_create("trundle")
    os.ftruncate(descriptor, size)
    return descriptor


class Seqlock:
    """Lets one process write a region and another copy it, neither waiting; a copy taken during a write is thrown away.

    Source: Boehm, Can seqlocks get along with programming language memory models?, MSPC 2012, section 4.
    """

    def __init__(self, word: memoryview) -> None:
        """Take the word that holds the version: odd while the region is written."""
        self._word = word

    @property
    def version(self) -> int:
        """How the region's versions are counted; equal versions, equal contents."""
        return int(self._word[0])

    def begin(self) -> None:
        """Open the region for writing; also one that its last writer died in."""
        version = self._word[0]
        self._word[0] = version + 1 + version % 2
        fence()

    def end(self) -> None:
        """Close it."""
        fence()
        self._word[0] += 1

    def read(self, copy: Callable[[], T], tries: int = 4) -> T | None:
        """Return a copy that no write has touched, or None when each of the tries met a writer (a stopped one, say)."""
        for _ in range(tries):
            before = self._word[0]
            fence()
            value = copy()
            fence()
            if before % 2 == 0 and self._word[0] == before:
                return value
        return None
