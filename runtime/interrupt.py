"""Ctrl-C and SIGTERM, which mean the same: while the robot drives the first asks the run to end in order, the second insists."""

from __future__ import annotations

import enum
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Phase(enum.Enum):
    """How far a run has come, and with it what a signal does."""

    OPENING = "opening"  # it breaks off at once
    DRIVING = "driving"  # the first one is a request, the second breaks off
    CLOSING = "closing"  # nothing: whatever brings the robot to rest and the recording to its end is not broken off


class Interrupts:
    """What the signals have asked for."""

    def __init__(self) -> None:
        """Start before anything is opened."""
        self.phase = Phase.OPENING
        self.asked = False

    def on_signal(self, number: int, frame: FrameType | None) -> None:
        """Take a signal.

        Raises:
            KeyboardInterrupt: where it breaks off what is being done.
        """
        repeated, self.asked = self.asked, True
        if self.phase is Phase.OPENING or (self.phase is Phase.DRIVING and repeated):
            raise KeyboardInterrupt


@contextmanager
def interruptible() -> Iterator[Interrupts]:
    """Within the block signals go to the `Interrupts` that it yields."""
    interrupts = Interrupts()
    before = {number: signal.signal(number, interrupts.on_signal) for number in SIGNALS}
    try:
        yield interrupts
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
