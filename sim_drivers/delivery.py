"""How a simulated device's samples reach the loop: some are lost, the rest arrive late, in order, in a bounded ring."""

from collections import deque
from typing import Generic, TypeVar

from drivers.interface.buffers import SampleRing

T = TypeVar("T")


class Delivery(Generic[T]):
    """A link with a fixed latency.  A sample can be drained once the world has reached its time of arrival."""

    def __init__(self, latency_ns: int, capacity: int) -> None:
        """Start with nothing on the way; `capacity` samples wait at most to be drained."""
        self.latency_ns = latency_ns
        self.arrived = 0
        self._on_the_way: deque[tuple[int, T]] = deque()
        self._ring: SampleRing[T] = SampleRing(capacity)

    @property
    def overflowed(self) -> int:
        """How many arrived but fell out of the ring because nobody drained it."""
        return self._ring.overflowed

    def send(self, now_ns: int, sample: T) -> None:
        """Put a sample on its way; it arrives `latency_ns` later."""
        self._on_the_way.append((now_ns + self.latency_ns, sample))
        self._arrive(now_ns)

    def drain(self, now_ns: int) -> tuple[T, ...]:
        """Return what has arrived by now since the last call, oldest first."""
        self._arrive(now_ns)
        return self._ring.drain()

    def _arrive(self, now_ns: int) -> None:
        while self._on_the_way and self._on_the_way[0][0] <= now_ns:
            self._ring.put(self._on_the_way.popleft()[1])
            self.arrived += 1
