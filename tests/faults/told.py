"""How a reduced runtime is asked for an ordinary stop, beside which its sudden end is measured."""

import signal
import threading
from collections.abc import Iterator

PERIOD_S = 0.05  # of the commands


def until_told() -> Iterator[None]:
    """Yield once a period until the parent asks for it (SIGUSR1)."""
    told = threading.Event()
    signal.signal(signal.SIGUSR1, lambda *_: told.set())
    while not told.wait(PERIOD_S):
        yield
