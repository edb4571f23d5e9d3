"""Capture times of messages that bear no stamp and are sent on a beat."""

from __future__ import annotations

LATE_IN_A_ROW = 3  # then the beat itself is another one: messages were lost, or the sender paused
LEAK = 100  # the beat gives way to late arrivals by this part of a period, which is more than two crystals differ by


class Cadence:
    """The beat that arrivals are late against.

    A host that is busy sees what was sent one by one come in a bunch; by its arrivals a wheel would have raced, and the other
    two with it, as the three of a sample must be of one time.  No message comes before its beat, so that the earliest tell it.
    """

    def __init__(self, period_ns: int) -> None:
        """Expect a message every period."""
        self._period_ns = period_ns
        self._beat_ns: int | None = None
        self._late = 0

    def captured_ns(self, arrived_ns: int) -> int:
        """Return when a message that arrived then was sent; never later than it arrived.

        >>> cadence = Cadence(10)
        >>> [cadence.captured_ns(arrived) for arrived in (100, 110, 129, 130, 140)]
        [100, 110, 120, 130, 140]
        """
        if self._beat_ns is None:
            self._beat_ns = arrived_ns
            return arrived_ns
        due_ns = self._beat_ns + self._period_ns
        self._late = self._late + 1 if arrived_ns - due_ns > self._period_ns // 2 else 0
        if self._late >= LATE_IN_A_ROW:
            self._beat_ns, self._late = arrived_ns, 0
        else:
            self._beat_ns = min(arrived_ns, due_ns + self._period_ns // LEAK)
        return self._beat_ns
