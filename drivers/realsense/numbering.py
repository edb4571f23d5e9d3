"""What a device's frame counter tells: which frames were lost on the way, and which came twice."""

from __future__ import annotations

MOST_LOST = 100_000  # a greater step is a counter that was set anew


class Numbering:
    """Numbers the frames of a stream without a break over every time that it is opened.

    >>> numbering = Numbering(10)
    >>> [numbering.take(number) for number in (7, 8, 8, 11, 3)], numbering.lost
    ([10, 11, None, 14, 15], 2)
    """

    def __init__(self, first: int) -> None:
        """Begin with a number that is above all that were given out before."""
        self._next = first
        self._last: int | None = None  # what the device's counter said
        self.lost = 0

    def restart(self) -> None:
        """Let the device's counter begin anywhere: it was opened again."""
        self._last = None

    def take(self, number: int) -> int | None:
        """Return the sequence number of a frame, or None for one that has come already."""
        step = 1 if self._last is None else number - self._last
        if step == 0:
            return None
        if not 0 < step <= MOST_LOST:
            step = 1
        self._last = number
        self.lost += step - 1
        self._next += step
        return self._next - 1
