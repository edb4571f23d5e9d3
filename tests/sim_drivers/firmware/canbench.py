"""A world with three emulated wheel controllers on python-can's virtual bus, stepped by the test in lockstep."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import can
import numpy as np

from drivers.interface.kinematics import OmniThreeWheel
from sim_drivers.firmware.firmware import FirmwareSetup, LockstepHost
from sim_drivers.firmware.wheel_controllers import WheelControllers
from sim_drivers.scenarios.square import Square, SquareSettings
from sim_drivers.world import MujocoWorld, WorldSettings

NODES = (4, 5, 6)
BASE = OmniThreeWheel.symmetric(0.05, 0.10, np.pi / 3)
_channels = count()


@dataclass(frozen=True)
class Wire:
    """What an omni_can driver's settings would say."""

    channel: str
    node_ids: tuple[int, int, int] = NODES
    nominal: OmniThreeWheel = BASE
    signs: tuple[int, int, int] = (1, 1, 1)
    gear_ratio: float = 1.0

    @property
    def bus_arguments(self) -> dict[str, Any]:
        return {"interface": "virtual", "channel": self.channel}

    @property
    def place(self) -> str:
        return f"virtual {self.channel}"


@dataclass
class CanBench:
    """The host's end of the bus, by bytes."""

    world: MujocoWorld
    firmware: WheelControllers
    bus: can.BusABC
    heard: list[can.Message] = field(default_factory=list)

    def wait(self, seconds: float) -> None:
        """Let time pass and note every frame."""
        self.world.step_to(self.world.now_ns + round(seconds * 1e9))
        while (message := self.bus.recv(timeout=0.0)) is not None:
            self.heard.append(message)

    def send(self, identifier: int, data: bytes = b"", remote: bool = False) -> None:
        dlc = 8 if remote else None
        self.bus.send(can.Message(arbitration_id=identifier, data=data, dlc=dlc, is_remote_frame=remote, is_extended_id=False))

    def frames(self, identifier: int) -> list[bytes]:
        """Return the payloads under an identifier since the last `forget`."""
        return [bytes(message.data) for message in self.heard if message.arbitration_id == identifier]

    def forget(self) -> None:
        self.heard.clear()

    def ask(self, identifier: int) -> list[bytes]:
        """Return what answers a request."""
        self.forget()
        self.send(identifier, remote=True)
        self.wait(0.01)
        return self.frames(identifier)

    def arm(self) -> None:
        """Clear errors, velocity control, closed loop."""
        for node in NODES:
            self.send(node << 5 | 0x18, b"\0")
            self.send(node << 5 | 0x0B, struct.pack("<II", 2, 1))
            self.send(node << 5 | 0x07, struct.pack("<I", 8))
        self.wait(0.01)

    def drive(self, turns_s: tuple[float, float, float], seconds: float) -> None:
        """Send velocities at 50 Hz."""
        for _ in range(round(seconds / 0.02)):
            for node, velocity in zip(NODES, turns_s, strict=True):
                self.send(node << 5 | 0x0D, struct.pack("<ff", velocity, 0.0))
            self.wait(0.02)

    def speed(self) -> float:
        """Return the fastest wheel's rate [turn/s]."""
        return float(np.abs(self.world.data.qvel[self.firmware._velocities]).max() / (2 * np.pi))


@contextmanager
def can_bench(seed: int = 1, wire: dict[str, Any] | None = None, **settings: Any) -> Iterator[CanBench]:
    world = MujocoWorld(Square(SquareSettings()).draw(0), WorldSettings())
    driver = Wire(f"bench-{next(_channels)}", **(wire or {}))
    quiet = {"loss_probability": 0.0, "boot_s": 0.0} | settings
    firmware = WheelControllers(
        driver, WheelControllers.Settings(**quiet), FirmwareSetup("base", seed, world, LockstepHost(world))
    )
    world.compile()
    firmware.open()
    with can.Bus(**driver.bus_arguments) as bus:
        try:
            yield CanBench(world, firmware, bus)
        finally:
            firmware.close()
