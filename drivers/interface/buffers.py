"""How samples cross from a device's own thread to the loop, which never waits for them."""

import threading
from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class NewestSlot(Generic[T]):
    """Holds the newest item; what was not taken in time is overwritten and counted."""

    def __init__(self) -> None:
        """Start empty."""
        self._lock = threading.Lock()
        self._item: T | None = None
        self.overwritten = 0

    def put(self, item: T) -> None:
        """Replace the item."""
        with self._lock:
            if self._item is not None:
                self.overwritten += 1
            self._item = item

    def take(self) -> T | None:
        """Return the newest item once, or None when there is nothing new."""
        with self._lock:
            item, self._item = self._item, None
            return item


class SampleRing(Generic[T]):
    """Holds the samples since the last drain, at most `capacity`; the oldest fall out and are counted."""

    def __init__(self, capacity: int) -> None:
        """Start empty.

        Raises:
            ValueError: capacity is not positive.
        """
        if capacity < 1:
            raise ValueError(f"a sample ring holds at least one sample, not {capacity}")
        self._lock = threading.Lock()
        self._items: deque[T] = deque(maxlen=capacity)
        self.overflowed = 0

    def put(self, item: T) -> None:
        """Append one sample."""
        with self._lock:
            if len(self._items) == self._items.maxlen:
                self.overflowed += 1
            self._items.append(item)

    def drain(self) -> tuple[T, ...]:
        """Return every sample since the last call, oldest first."""
        with self._lock:
            items = tuple(self._items)
            self._items.clear()
            return items
