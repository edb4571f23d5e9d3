"""The one process at an autopilot's wire, for the base and the inertial unit that share it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivers.interface.devices import DeviceHealth, DeviceIdentity, DeviceSetup, DeviceState
from drivers.interface.errors import DeviceError
from drivers.interface.samples import Stamp
from drivers.interface.shared_ring import Records
from drivers.io.channels import MemorySpec, RingSpec
from drivers.io.host_clock import HostClock
from drivers.io.process import IoProcess, IoSpec
from drivers.rover_serial.records import IMU, POSE, WHEELS
from drivers.rover_serial.settings import LinkSettings, RoverImuSettings, RoverSettings
from drivers.rover_serial.signing import read_key

RINGS = {"wheels": RingSpec("wheels", WHEELS, 512), "pose": RingSpec("pose", POSE, 512), "imu": RingSpec("imu", IMU, 1024)}
OPEN_MARGIN_S = 5.0  # for starting the process


class RoverLink:
    """Started when the first of its devices is opened, by when all of them have said what they want."""

    def __init__(self) -> None:
        """Nobody wants anything yet."""
        self._base = RoverSettings()
        self._base_name = self._imu_name = ""
        self._imu: RoverImuSettings | None = None
        self._key: bytes | None = None
        self._io: IoProcess | None = None

    def serve_base(self, name: str, settings: RoverSettings) -> None:
        """Serve a base, whose settings are those of the wire.

        Raises:
            ConfigurationError: the signing key cannot be used.
        """
        self._base_name, self._base = name, settings
        self._key = None if settings.signing_key is None else read_key(settings.signing_key)

    def serve_imu(self, name: str, settings: RoverImuSettings) -> None:
        """Serve the inertial unit; without a base the wire has its defaults."""
        self._imu_name, self._imu = name, settings
        if not self._base_name:
            self._base = RoverSettings(url=settings.url)

    def open(self) -> None:
        """Start the process.

        Raises:
            DeviceError: the autopilot cannot be reached, or is not what is needed.
        """
        name = self._base_name or self._imu_name
        names = ["wheels", "pose", *(["imu"] if self._imu is not None else [])]
        memory = MemorySpec(tuple(RINGS[ring] for ring in names), (), command_values=2)
        settings = LinkSettings(name, self._base, self._imu, self._key)
        open_s = self._base.connect_s + self._base.ready_s + OPEN_MARGIN_S
        self._io = IoProcess(IoSpec(name, "drivers.rover_serial.session:RoverSession", settings, memory, open_s=open_s))
        self._io.open()

    def close(self) -> None:
        """End the process; what it has counted can still be asked."""
        if self._io is not None:
            self._io.close()

    @property
    def io(self) -> IoProcess:
        """The process.

        Raises:
            DeviceError: it was never started.
        """
        if self._io is None:
            raise DeviceError(f"{self._base_name or self._imu_name} is not open")
        return self._io

    @property
    def started(self) -> bool:
        """Whether there is, or was, a process."""
        return self._io is not None

    @property
    def pid(self) -> int | None:
        """Its process id, or None."""
        return None if self._io is None else self._io.pid


class Channel:
    """What base and unit have in common: rings of the shared link, and what is told of them."""

    def __init__(self, setup: DeviceSetup, url: str, rings: tuple[str, ...], rate_hz: float, *, moves: bool) -> None:
        """Join the link of this URL; nothing is touched."""
        self._moves = moves
        self._setup = setup
        self._lease = setup.links.get(f"mavlink {url}", RoverLink)
        self._names = rings
        self._period_ns = round(1e9 / rate_hz)
        self._clock = HostClock(setup.now_ns)

    @property
    def link(self) -> RoverLink:
        """The link."""
        return self._lease.it

    @property
    def is_open(self) -> bool:
        """Whether this device is open."""
        return self._lease.held

    def open(self) -> None:
        """Open the link, or join it; what it has delivered before is not ours.

        Raises:
            DeviceError: the autopilot cannot be reached, or is not what is needed.
        """
        self._setup.now_ns()
        self._lease.open()
        for name in self._names:
            self.link.io.ring(name).skip()

    def close(self) -> None:
        """Leave the link."""
        self._lease.close()

    def command(self, values: NDArray[np.float64], expires_ns: int) -> None:
        """Give an order that holds until `expires_ns` on the loop's clock.

        Raises:
            DeviceError: it is not open.
        """
        if not self.is_open:
            raise DeviceError(f"{self._setup.name} is not open and takes no commands")
        self.link.io.command(values, self._clock.to_host(expires_ns))

    def drain(self) -> Iterator[tuple[str, list[Stamp], Records]]:
        """Yield the new records of each ring that has some, with their stamps."""
        for name in self._names if self.is_open else ():
            records = self.link.io.ring(name).drain()
            if len(records):
                yield name, self._clock.stamps(records), records

    def health(self) -> DeviceHealth:
        """Say how it stands."""
        if not self.link.started:
            return DeviceHealth(self._setup.name, DeviceState.CLOSED, expected_period_ns=self._period_ns)
        rings = (self.link.io.ring(name) for name in self._names)
        health = self.link.io.health().of_device(self._setup.name, self._period_ns, *rings)
        if not self.is_open:
            health = replace(health, state=DeviceState.CLOSED, fault="")
        return health if self._moves else replace(health, expired_commands=0)

    def identity(self, model: str) -> DeviceIdentity:
        """Return what the autopilot has told of itself."""
        if not self.link.started:
            return DeviceIdentity(self._setup.name, model)
        record = self.link.io.health()
        return record.identity(self._setup.name, model)
