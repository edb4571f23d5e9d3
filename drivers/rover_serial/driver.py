"""The rover, as the loop sees it."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.devices import DeviceHealth, DeviceIdentity, DeviceSetup
from drivers.interface.errors import DeviceError
from drivers.interface.geometry import SE2
from drivers.interface.kinematics import SkidSteer
from drivers.interface.samples import BaseSample, PoseSample, Stamp, WheelSample, frozen_array
from drivers.interface.settings import Settings
from drivers.interface.shared_ring import Records
from drivers.rover_serial.link import Channel
from drivers.rover_serial.settings import RoverSettings


class RoverBase:
    """A skid-steer base behind an ArduPilot or PX4 autopilot; the wire is a process of its own."""

    Settings: ClassVar[type[Settings]] = RoverSettings
    role: ClassVar[str] = "base"
    real_time: ClassVar[bool] = True

    def __init__(self, settings: RoverSettings, setup: DeviceSetup) -> None:
        """Read the signing key; nothing else is touched.

        Raises:
            ConfigurationError: the key cannot be used.
        """
        self._settings, self._setup = settings, setup
        self._limits, self._kinematics = settings.limits, settings.nominal
        self._channel = Channel(setup, settings.url, ("wheels", "pose"), settings.rate_hz, moves=True)
        self._channel.link.serve_base(setup.name, settings)
        self._covariance = np.diag([settings.position_std_m**2, settings.position_std_m**2, settings.yaw_std_rad**2])  # (3, 3)

    @property
    def limits(self) -> BaseLimits:
        """What it may be asked."""
        return self._limits

    @property
    def kinematics(self) -> SkidSteer:
        """The nominal geometry; one wheel stands for each side."""
        return self._kinematics

    def open(self) -> None:
        """Find the autopilot and have it send what is needed; nothing moves, and nothing is armed.

        Raises:
            DeviceError: nobody answers, or it is not what is needed, or its pre-arm checks do not pass in time.
        """
        self._channel.open()

    def command(self, twist: BodyTwist, expires_ns: int) -> None:
        """Follow the twist until `expires_ns`, then brake.  The first one after `open` or a reset arms the autopilot.

        Raises:
            DeviceError: it is not finite, sideways, or the base is not open.
        """
        if not twist.finite:
            raise DeviceError(f"{self._setup.name}: the twist {twist} is not finite")
        if twist.vy != 0.0:
            raise DeviceError(f"{self._setup.name}: this base cannot move sideways; vy = {twist.vy} m/s was asked")
        self._channel.command(np.array((twist.vx, twist.wz)), expires_ns)

    def drain(self) -> tuple[BaseSample, ...]:
        """Return the samples that have arrived since the last call, oldest first; poses where wheels are not told."""
        samples: list[BaseSample] = []
        for name, stamps, records in self._channel.drain():
            samples += self._wheels(stamps, records) if name == "wheels" else self._poses(stamps, records)
        return tuple(samples)

    def stop(self) -> None:
        """Brake to rest."""
        if self._channel.is_open:
            self._channel.link.io.stop()

    def close(self) -> None:
        """Brake to rest, disarm, and leave the wire."""
        self.stop()
        self._channel.close()

    def clear_faults(self) -> None:
        """Let the next command arm the autopilot."""
        if self._channel.is_open:
            self._channel.link.io.clear_faults()

    def health(self) -> DeviceHealth:
        """Say how it stands."""
        return self._channel.health()

    def identity(self) -> DeviceIdentity:
        """Return firmware and protocol, once the autopilot has told of them."""
        return self._channel.identity("skid-steer rover")

    def _wheels(self, stamps: list[Stamp], records: Records) -> list[BaseSample]:
        radius_m = self._settings.wheel_radius_m
        position, velocity = (frozen_array(records[name] / radius_m) for name in ("distance_m", "rate_m_s"))  # (n, 2)
        return [*map(WheelSample, stamps, position, velocity)]

    def _poses(self, stamps: list[Stamp], records: Records) -> list[BaseSample]:
        covariance = self._covariance
        poses = zip(stamps, records["pose"].tolist(), records["twist"].tolist(), strict=True)
        return [PoseSample(stamp, SE2(*pose), BodyTwist(*twist), frozen_array(covariance.copy())) for stamp, pose, twist in poses]
