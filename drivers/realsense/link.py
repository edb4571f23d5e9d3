"""The process at one camera, shared by the devices that read its streams."""

from __future__ import annotations

import math
from dataclasses import replace

from drivers.interface.devices import DeviceHealth, DeviceIdentity, DeviceSetup, DeviceState
from drivers.interface.errors import ConfigurationError
from drivers.interface.links import Lease
from drivers.io.process import IoProcess, IoSpec
from drivers.realsense.plan import MEMORY, CameraPlan, Figure
from drivers.realsense.settings import CameraSettings, ImuSettings, SourceSettings

STUCK_S = 3.0  # librealsense may hold the process up for so long, in finding a camera again


class CameraLink:
    """Learns from every device what it wants, and starts the process when the first of them is opened."""

    def __init__(self, name: str, source: SourceSettings) -> None:
        """Take the first device's name for messages; nothing is started."""
        self._name = name
        self.plan = CameraPlan(source)
        self.io = self._process()

    def want(self, settings: CameraSettings | ImuSettings) -> None:
        """Read a device's streams, too."""
        if isinstance(settings, CameraSettings):
            self.plan = replace(self.plan, camera=settings)
        else:
            self.plan = replace(self.plan, imu=settings)

    def open(self) -> None:
        """Start the process.

        Raises:
            ConfigurationError: there is no such recording.
            DeviceError: the camera is not there, or sends nothing.
        """
        path = self.plan.source.path
        if path is not None and not path.is_file():
            raise ConfigurationError(f"{self._name}.path: there is no recording '{path}'")
        self.io = self._process()
        self.io.open()

    def close(self) -> None:
        """End the process."""
        self.io.close()

    def _process(self) -> IoProcess:
        session, patience_s = "drivers.realsense.session:RealSenseSession", self.plan.source.connect_s + 5.0
        return IoProcess(IoSpec(self._name, session, self.plan, MEMORY, open_s=patience_s, silent_s=STUCK_S))


def link_of(settings: CameraSettings | ImuSettings, setup: DeviceSetup) -> Lease[CameraLink]:
    """Return a device's hold on the process at its camera."""
    lease = setup.links.get(f"realsense {settings.place}", lambda: CameraLink(setup.name, settings))
    lease.it.want(settings)
    return lease


def health_of(name: str, lease: Lease[CameraLink], dropped: Figure) -> DeviceHealth:
    """Return how a device stands that holds the lease."""
    record = lease.it.io.health()
    if not lease.held:
        return DeviceHealth(name, DeviceState.CLOSED)
    lost = record.figures[dropped]
    return DeviceHealth(name, record.state, record.fault, dropped=0 if math.isnan(lost) else round(lost))


def identity_of(name: str, lease: Lease[CameraLink]) -> DeviceIdentity:
    """Return what the camera has told of itself."""
    record = lease.it.io.health()
    return replace(record.identity(name, ""), serial=record.serial and f"serial number {record.serial}")
