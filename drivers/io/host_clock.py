"""Two scales of time: the loop's clock, and CLOCK_MONOTONIC, which every process of this machine shares."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from itertools import repeat

from drivers.interface.samples import Stamp
from drivers.interface.shared_ring import Records

TOLERANCE_NS = 20_000  # a reading that took longer was interrupted and says nothing


class HostClock:
    """Converts between the loop's clock and CLOCK_MONOTONIC; they differ where a simulated world is paced by the host."""

    def __init__(self, now_ns: Callable[[], int]) -> None:
        """Take the loop's clock; it is not asked yet."""
        self._now_ns = now_ns
        self._offset_ns: int | None = None  # the loop's time less the host's

    def to_host(self, loop_ns: int) -> int:
        """Return a time of the loop on CLOCK_MONOTONIC."""
        return loop_ns - self.offset_ns()

    def to_loop(self, host_ns: int) -> int:
        """Return a time of CLOCK_MONOTONIC on the loop's clock."""
        return host_ns + self.offset_ns()

    def stamps(self, records: Records, clocks: Iterable[str] | None = None) -> list[Stamp]:
        """Return the stamps of records that have `captured_ns` and `received_ns` on CLOCK_MONOTONIC, and a `sequence`.

        `clocks` names each one's own clock; none: they are all the host's.
        """
        offset_ns = self.offset_ns()
        captured_ns, received_ns = ((records[name] + offset_ns).tolist() for name in ("captured_ns", "received_ns"))
        return [*map(Stamp, captured_ns, received_ns, records["sequence"].tolist(), clocks or repeat("host"))]

    def offset_ns(self) -> int:
        """Return the difference; it stays the same number as long as it is the same within what can be measured."""
        before_ns = time.monotonic_ns()
        loop_ns = self._now_ns()
        took_ns = time.monotonic_ns() - before_ns
        offset_ns = loop_ns - before_ns - took_ns // 2
        if self._offset_ns is None or (took_ns < TOLERANCE_NS and abs(offset_ns - self._offset_ns) > TOLERANCE_NS):
            self._offset_ns = 0 if abs(offset_ns) <= max(took_ns, TOLERANCE_NS) else offset_ns
        return self._offset_ns
