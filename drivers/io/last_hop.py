"""The dead man at the last hop: no order is sent twice, none outlives its end, and then comes zero."""

from __future__ import annotations

import sys

from drivers.io.command_slot import Order
from drivers.io.health import HealthRecord
from drivers.io.session import Session

NEVER_NS = sys.maxsize


class LastHop:
    """Stands between the newest order and the session.  It is passed the time."""

    def __init__(self, session: Session, health: HealthRecord, last: int) -> None:
        """Act on no order up to and including number `last`: those were another process's."""
        self._session = session
        self._health = health
        self._last = last
        self.ends_ns = NEVER_NS  # when the order in force expires

    def step(self, order: Order, now_ns: int) -> None:
        """Send what is fresh; rest when the order in force has expired."""
        if order.sequence > self._last:
            self._last = order.sequence
            if not len(order.values):
                self.rest()
            elif now_ns < order.expires_ns:
                self.ends_ns = order.expires_ns
                self._session.send(order.values, now_ns)
            else:
                self._expire()
        elif now_ns >= self.ends_ns:
            self._expire()

    def forget(self, order: Order) -> None:
        """Let an order pass unsent: the wire is down, and it must not be sent once it is up again."""
        self._last = max(self._last, order.sequence)

    def rest(self) -> None:
        """Rest now, whatever was in force."""
        self.ends_ns = NEVER_NS
        self._session.rest()

    def _expire(self) -> None:
        self._health.expired_commands += 1
        self.rest()
