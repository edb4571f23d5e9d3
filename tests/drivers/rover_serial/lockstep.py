"""A session and an emulated autopilot on one wire over loopback and one clock, stepped by the test; no process."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from drivers.interface.devices import DeviceState
from drivers.interface.errors import DeviceError
from drivers.io.channels import MemorySpec
from drivers.io.command_slot import Order
from drivers.io.last_hop import LastHop
from drivers.io.session import local_port
from drivers.rover_serial.link import RINGS
from drivers.rover_serial.session import RoverSession
from drivers.rover_serial.settings import LinkSettings, RoverImuSettings, RoverSettings
from sim_drivers.firmware.firmware import FirmwareSetup, LockstepHost
from sim_drivers.firmware.rover_autopilot import RoverAutopilot
from sim_drivers.scenarios.square import Square, SquareSettings
from sim_drivers.world import MujocoWorld, WorldSettings
from tests.ports import free_port

MS = 1_000_000
UNIX_NS = 1_800_000_000 * 1_000_000_000
MEMORY = MemorySpec(tuple(RINGS.values()), (), command_values=2)


class Lockstep:
    """Both ends."""

    def __init__(
        self, settings: RoverSettings, firmware: RoverAutopilot, world: MujocoWorld, key=None, unix_ns=UNIX_NS, **session
    ):
        self.world, self.firmware, self.settings = world, firmware, settings
        self.port = replace(local_port(MEMORY, "base"), **session)
        link = LinkSettings("base", settings, RoverImuSettings(url=settings.url), key)
        self.session = RoverSession(link, self.port, unix_ns=lambda: unix_ns + world.now_ns)
        self.hop = LastHop(self.session, self.port.health, 0)
        self.order = Order(0, 0, np.zeros(0))
        self.lost: str = ""

    @property
    def health(self):
        return self.port.health

    @property
    def is_open(self) -> bool:
        return self.health.state is DeviceState.OPEN

    @property
    def place(self) -> tuple[float, float]:
        x, y, _ = self.world.data.body("base").xpos
        return float(x), float(y)

    def speed(self) -> float:
        return float(np.linalg.norm(self.world.data.qvel[:2]))

    def samples(self, ring="wheels"):
        return self.port.rings[ring].drain()

    def wait(self, seconds: float, twist: tuple[float, float] | None = None) -> "Lockstep":
        """Let time pass; command at 20 Hz, each for 150 ms; a lost wire ends it."""
        for step in range(round(seconds / 0.01)):
            self.world.step_to(self.world.now_ns + 10 * MS)
            now_ns = self.world.now_ns
            if twist is not None and step % 5 == 0:
                self.order = Order(self.order.sequence + 1, now_ns + 150 * MS, np.array(twist))
            try:
                self.session.poll(now_ns)
            except (DeviceError, OSError) as error:
                self.lost = str(error)
                return self
            self.hop.step(self.order, now_ns)
        return self

    def reconnect(self) -> "Lockstep":
        """Do what the process does after the wire was lost."""
        self.session.close()
        self.port.reopened, self.lost = True, ""
        self.hop.forget(self.order)
        self.session.open()
        return self


@contextmanager
def lockstep(firmware=None, key=None, key_file=None, their_key_file=None, scheme="tcp", **settings) -> Iterator[Lockstep]:
    world = MujocoWorld(Square(SquareSettings()).draw(0), WorldSettings())
    url = f"{scheme}:127.0.0.1:{free_port()}"
    chosen = RoverSettings(**({"url": url, "signing_key": key_file, "gather_s": 0.0} | settings))
    theirs = chosen.model_copy(update={"signing_key": their_key_file or key_file})
    told = RoverAutopilot.Settings(**({"loss_probability": 0.0, "estimate_s": 0.2} | (firmware or {})))
    autopilot = RoverAutopilot(theirs, told, FirmwareSetup("base", 1, world, LockstepHost(world)))
    world.compile()
    autopilot.open()
    both = Lockstep(chosen, autopilot, world, key)
    try:
        both.session.open()
        yield both
    finally:
        both.session.close()
        autopilot.close()
