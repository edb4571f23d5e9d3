"""A session driven step by step, without a process: the controller's own clock is the time."""

from dataclasses import replace

import numpy as np

from drivers.franka.client import LibfrankaClient
from drivers.franka.driver import MEMORY
from drivers.franka.orders import packed
from drivers.franka.session import FrankaSession
from drivers.franka.settings import FrankaSettings
from drivers.interface.commands import JointTrajectory
from drivers.io.command_slot import Order
from drivers.io.last_hop import LastHop
from drivers.io.session import local_port

MS = 1_000_000


class Listening(LibfrankaClient):
    """Remembers the newest state."""

    newest = None

    def read(self):
        self.newest = super().read()
        return self.newest


class Driven:
    """One session, one client, and orders."""

    def __init__(self, host, reopened=False, **settings):
        self.port = local_port(MEMORY, "arm")
        self.port.reopened = reopened
        self.client = None
        chosen = FrankaSettings(host=host, priority=None, **settings)
        self.session = FrankaSession(chosen, self.port, self._connect, lambda: self.now_ns)
        self.hop = LastHop(self.session, self.port.health, 0)
        self.order = Order(0, 0, np.zeros(0))
        self.session.open()
        self.poll(3)

    @property
    def now_ns(self):
        return 0 if self.client.newest is None else self.client.newest.robot_ns

    @property
    def health(self):
        return self.port.health

    @property
    def position_rad(self):
        return self.client.newest.position_rad

    def poll(self, count=1):
        for _ in range(count):
            self.session.poll(self.now_ns)
            self.hop.step(self.order, self.now_ns)

    def command(self, trajectory, lifetime_s):
        expires_ns = self.now_ns + round(lifetime_s * 1e9)
        self.order = Order(self.order.sequence + 1, expires_ns, packed(trajectory, trajectory.start_ns))

    def turn(self, by_rad, seconds, lifetime_s=10.0, speed_factor=1.0):
        """Turn joints from where they are, (7,) [rad], starting now."""
        start = self.position_rad
        knots = np.stack((start, start + by_rad))
        trajectory = JointTrajectory(self.now_ns, np.array([0.0, seconds]), knots, np.zeros_like(knots))
        self.command(replace(trajectory, speed_factor=speed_factor), lifetime_s)

    def samples(self):
        return self.port.rings["joints"].drain()

    def until(self, holds, most=4000):
        """Poll until something holds."""
        for _ in range(most):
            self.poll()
            if holds():
                return
        raise AssertionError(f"it never happened; {self.health.fault!r}, {self.client.newest}")

    def _connect(self, name, settings):
        self.client = Listening(name, settings)
        return self.client
