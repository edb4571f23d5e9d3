"""A session and an emulated camera in one world and by one clock: no process, no sleeping."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.io.session import Port, local_port
from drivers.realsense.plan import MEMORY, CameraPlan
from drivers.realsense.session import RealSenseSession
from drivers.realsense.settings import CameraSettings, ImuSettings
from sim_drivers.firmware.camera_imu import CameraImuSettings, RealSenseImuFirmware
from sim_drivers.firmware.depth_camera import CameraFirmwareSettings, RealSenseFirmware
from sim_drivers.firmware.firmware import FirmwareSetup, LockstepHost
from sim_drivers.world import MujocoWorld
from tests.contract.streams import build_world, device_of

_NUMBERS = count()
STEP_NS = 5_000_000  # of the physics


def fresh_name() -> str:
    """Return a name of shared memory that no other test uses."""
    return f"test-{os.getpid()}-{next(_NUMBERS)}"


@dataclass
class Lockstep:
    """Both ends, polled in step with the world."""

    world: MujocoWorld
    session: RealSenseSession
    port: Port
    firmware: tuple[Any, ...]
    base: Any

    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds * 1e9 / STEP_NS)):
            self.world.step_to(self.world.now_ns + STEP_NS)
            self.session.poll(self.world.now_ns)

    def frames(self, seconds: float) -> list[tuple[Any, np.ndarray]]:
        """Return what comes: records and images."""
        found = []
        for _ in range(round(seconds * 1e9 / STEP_NS)):
            self.wait(STEP_NS * 1e-9)
            taken = self.port.frames["depth"].take()
            if taken is not None:
                meta, pixels = taken
                found.append((meta, pixels.view(np.uint16).reshape(meta["height"], meta["width"])))
        return found

    def motion(self) -> np.ndarray:
        return self.port.rings["motion"].drain()


@contextmanager
def lockstep(camera: dict[str, Any] | None, imu: dict[str, Any] | None = None, **firmware: Any) -> Iterator[Lockstep]:
    """Emulate what is given settings for; `firmware` sets the camera's own."""
    name, world = fresh_name(), build_world()
    host = LockstepHost(world)
    common = {"source": "emulated", "memory": name}
    cameras = CameraSettings(**common, **camera) if camera is not None else None
    imus = ImuSettings(**common, **imu) if imu is not None else None
    parts: list[Any] = []
    if cameras is not None:
        parts.append(RealSenseFirmware(cameras, CameraFirmwareSettings(**firmware), FirmwareSetup("camera", 3, world, host)))
    if imus is not None:
        parts.append(RealSenseImuFirmware(imus, CameraImuSettings(), FirmwareSetup("imu", 3, world, host)))
    base = device_of("sim_omni", world, "carrier")
    world.compile()
    base.open()
    for part in parts:
        part.open()
    port = replace(local_port(MEMORY, "camera"))
    session = RealSenseSession(CameraPlan(cameras or imus, cameras, imus), port)
    session.open()
    try:
        yield Lockstep(world, session, port, tuple(parts), base)
    finally:
        session.close()
        for part in parts:
            part.close()


FORWARD = BodyTwist(0.2, 0.0, 0.3)
