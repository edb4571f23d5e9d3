"""A bus that the test holds both ends of, and a session on it, by the clock of the test."""

from dataclasses import replace

import numpy as np

from drivers.interface.devices import DeviceState
from drivers.io.command_slot import Order
from drivers.io.last_hop import LastHop
from drivers.io.session import local_port
from drivers.omni_can.can_wire import Frame
from drivers.omni_can.driver import MEMORY, session_settings
from drivers.omni_can.session import OmniCanSession
from drivers.omni_can.settings import OmniCanSettings

MS = 1_000_000
NODES = (3, 4, 5)


class FakeBus:
    """Frames to the session, and what it sent."""

    def __init__(self):
        self.incoming, self.sent, self.closed = [], [], False

    def fileno(self):
        return -1

    def receive(self, now_ns):
        frames, self.incoming = self.incoming, []
        yield from frames

    def send(self, identifier, data, request=False):
        self.sent.append((identifier, bytes(data), request))

    def close(self):
        self.closed = True

    def put(self, identifier, text, plain=True, age_ns=0):
        self.incoming.append(Frame(identifier, bytes.fromhex(text) if isinstance(text, str) else text, plain, age_ns))

    def take(self):
        sent, self.sent = self.sent, []
        return sent


class Driven:
    """A session under the dead man, with time in the test's hands."""

    def __init__(self, bus=None, reopened=False, begin_ns=0, **settings):
        self.bus = FakeBus() if bus is None else bus
        chosen = OmniCanSettings(**({"node_ids": NODES, "firmware": "0.6", "latency_s": 0.0} | settings))
        self.port = replace(local_port(MEMORY, "base"), reopened=reopened)
        self.session = OmniCanSession(session_settings(chosen, "base"), self.port, lambda _: self.bus)
        self.hop = LastHop(self.session, self.port.health, 0)
        self.order = Order(0, 0, np.zeros(0))
        self.now_ns = begin_ns
        self.session.open()

    @property
    def health(self):
        return self.port.health

    @property
    def is_open(self):
        return self.health.state is DeviceState.OPEN

    def poll(self, after_ms=0):
        self.now_ns += round(after_ms * MS)
        self.session.poll(self.now_ns)
        self.hop.step(self.order, self.now_ns)

    def command(self, turns_s, lifetime_ms=100):
        self.order = Order(self.order.sequence + 1, self.now_ns + round(lifetime_ms * MS), np.array(turns_s))
        self.poll()

    def samples(self):
        return self.port.rings["wheels"].drain()

    def hear(self, beat="00 00 00 00 01 00 00 00", turns=0.0, turns_s=0.0):
        """Let every axis send a heartbeat and its encoder."""
        for node in NODES:
            if beat:
                self.bus.put(node << 5 | 0x01, beat)
            self.bus.put(node << 5 | 0x09, np.array([turns, turns_s], "<f4").tobytes())

    def driving(self):
        """Bring it to driving, with axes that answer as told."""
        self.hear()
        self.poll()
        self.command((0.0, 0.0, 0.0))
        self.hear(CLOSED)
        self.poll()
        self.bus.take()
        return self


CLOSED = "00 00 00 00 08 00 00 00"
