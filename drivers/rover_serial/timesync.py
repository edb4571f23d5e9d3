"""How the autopilot's clock, which counts from its boot, stands to ours.

Source: MAVLink, Time Synchronization Protocol v2: the answer to TIMESYNC (tc1 = 0, ts1 = our time) carries the other's time in
tc1 and ours back in ts1; half of the time there and back lies between.
"""

from __future__ import annotations

from collections import deque

KEPT = 16  # exchanges; the quickest of them counts
SLOWEST_NS = 200_000_000  # an exchange that took longer says nothing


class TimeSync:
    """Offset of the autopilot's clock."""

    def __init__(self) -> None:
        """Nothing is known yet."""
        self._exchanges: deque[tuple[int, int]] = deque(maxlen=KEPT)  # (there and back, ours less theirs) [ns]
        self._offset_ns: int | None = None

    @property
    def known(self) -> bool:
        """Whether an exchange has succeeded."""
        return self._offset_ns is not None

    def answered(self, asked_ns: int, theirs_ns: int, now_ns: int) -> bool:
        """Take in an answer; return whether it was one to us and in time."""
        took_ns = now_ns - asked_ns
        if not 0 <= took_ns <= SLOWEST_NS or theirs_ns <= 0:
            return False
        self._exchanges.append((took_ns, asked_ns + took_ns // 2 - theirs_ns))
        self._offset_ns = min(self._exchanges)[1]
        return True

    def captured_ns(self, theirs_ns: int, now_ns: int, latency_ns: int) -> int:
        """Return when something happened that the autopilot stamped and we received now, on our clock.

        Without an answer it is taken for `latency_ns` old.
        """
        if self._offset_ns is None:
            return now_ns - latency_ns
        return min(theirs_ns + self._offset_ns, now_ns)
