"""How large frames cross between two processes: three buffers, the newest wins, and none is ever seen half written."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.shared_memory import Block, Seqlock

BUFFERS = 3  # one that is read, one that is newest, one that is written
U8 = NDArray[np.uint8]


class FrameSlot:
    """The newest frame: a small record about it and its bytes."""

    def __init__(self, block: Block, meta: np.dtype[Any], capacity_bytes: int) -> None:
        """Take the slot's place in the memory, for frames of at most `capacity_bytes`."""
        self._words = block.words(1)  # frames written
        self._locks = [Seqlock(block.words(1)) for _ in range(BUFFERS)]
        self._lengths = [block.words(1) for _ in range(BUFFERS)]
        self._meta = [block.array(meta, 1) for _ in range(BUFFERS)]
        self._bytes: list[U8] = [block.array(np.uint8, capacity_bytes).view(np.uint8) for _ in range(BUFFERS)]
        self._taken = self.written
        self.overwritten = 0  # frames that came and went between two calls of `take`

    @property
    def written(self) -> int:
        """How many frames were ever written."""
        return int(self._words[0])

    def put(self, meta: tuple[Any, ...], pixels: NDArray[Any]) -> None:
        """Replace the newest frame.

        Raises:
            ValueError: the frame is larger than the slot.
        """
        raw = np.ascontiguousarray(pixels).reshape(-1).view(np.uint8)
        index = self.written % BUFFERS
        if len(raw) > len(self._bytes[index]):
            raise ValueError(f"a frame of {len(raw)} bytes does not fit into a slot of {len(self._bytes[index])}")
        self._locks[index].begin()
        self._meta[index][0] = meta
        self._lengths[index][0] = len(raw)
        self._bytes[index][: len(raw)] = raw
        self._locks[index].end()
        self._words[0] += 1

    def take(self) -> tuple[np.void, U8] | None:
        """Return the newest frame once, its record and a copy of its bytes, or None when there is nothing new."""
        while (written := self.written) != self._taken:
            index = (written - 1) % BUFFERS
            frame = self._locks[index].read(partial(self._copy, index), tries=1)
            if frame is not None and self.written < written + BUFFERS - 1:  # else it may be a later frame's buffer
                self.overwritten += written - self._taken - 1
                self._taken = written
                return frame
            if written == self.written:  # its writer died in it, and no one writes any more
                return None
        return None

    def _copy(self, index: int) -> tuple[np.void, U8]:
        return self._meta[index][0].copy(), self._bytes[index][: self._lengths[index][0]].copy()
