"""The inertial unit inside the rover's autopilot."""

from __future__ import annotations

from typing import ClassVar

from drivers.interface.devices import DeviceHealth, DeviceIdentity, DeviceSetup
from drivers.interface.samples import ImuSample
from drivers.interface.settings import Settings
from drivers.rover_serial.link import Channel
from drivers.rover_serial.settings import RoverImuSettings


class RoverImu:
    """Rates and specific force, already in the base's axes: the autopilot knows how it is mounted."""

    Settings: ClassVar[type[Settings]] = RoverImuSettings
    role: ClassVar[str] = "imu"
    real_time: ClassVar[bool] = True

    def __init__(self, settings: RoverImuSettings, setup: DeviceSetup) -> None:
        """Join the wire; nothing is touched."""
        self._channel = Channel(setup, settings.url, ("imu",), settings.rate_hz, moves=False)
        self._channel.link.serve_imu(setup.name, settings)

    def open(self) -> None:
        """Open the wire, or join it.

        Raises:
            DeviceError: nobody answers, or the autopilot does not send what is needed.
        """
        self._channel.open()

    def drain(self) -> tuple[ImuSample, ...]:
        """Return the samples that have arrived since the last call, oldest first."""
        samples: list[ImuSample] = []
        for _, stamps, records in self._channel.drain():
            gyro, accel = (map(tuple, records[name].tolist()) for name in ("gyro_rad_s", "accel_m_s2"))
            samples += map(ImuSample, stamps, gyro, accel)
        return tuple(samples)

    def stop(self) -> None:
        """Do nothing: a sensor does not move."""

    def close(self) -> None:
        """Leave the wire."""
        self._channel.close()

    def health(self) -> DeviceHealth:
        """Say how it stands."""
        return self._channel.health()

    def identity(self) -> DeviceIdentity:
        """Return firmware and protocol, once the autopilot has told of them."""
        return self._channel.identity("inertial unit of the autopilot")
