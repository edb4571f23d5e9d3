"""The camera's inertial unit, as the loop sees it."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from drivers.interface.devices import DeviceHealth, DeviceIdentity, DeviceSetup
from drivers.interface.geometry import BODY_FROM_OPTICAL, SE3
from drivers.interface.samples import ImuSample
from drivers.interface.settings import Settings
from drivers.io.host_clock import HostClock
from drivers.realsense.link import health_of, identity_of, link_of
from drivers.realsense.plan import DOMAINS, Figure
from drivers.realsense.settings import ImuSettings


class RealSenseImu:
    """Gyroscope and accelerometer inside a RealSense, turned into base; with a camera of the same source it shares the process.

    Its samples are those of the place where the camera is; who estimates takes the lever arm out (`place_in_base_m`).
    """

    Settings: ClassVar[type[Settings]] = ImuSettings
    role: ClassVar[str] = "imu"
    real_time: ClassVar[bool] = True

    def __init__(self, settings: ImuSettings, setup: DeviceSetup) -> None:
        """Remember; the camera is not touched."""
        self._settings = settings
        self._setup = setup
        mount = SE3.from_euler(0.0, 0.0, 0.0, settings.roll_rad, settings.pitch_rad, settings.yaw_rad)
        self._base_from_optical = (mount @ BODY_FROM_OPTICAL).rotation  # (3, 3)
        self._clock = HostClock(setup.now_ns)
        self._lease = link_of(settings, setup)

    @property
    def place_in_base_m(self) -> tuple[float, float]:
        """Where it sits [m]."""
        return self._settings.x_m, self._settings.y_m

    def open(self) -> None:
        """Start the camera and wait for what it sends first.

        Raises:
            ConfigurationError: there is no such recording.
            DeviceError: no such camera, or it has no such sensor, or sends nothing.
        """
        self._setup.now_ns()
        self._lease.open()
        self._lease.it.io.ring("motion").skip()

    def stop(self) -> None:
        """Do nothing: it does not move."""

    def close(self) -> None:
        """Let go of the camera."""
        self._lease.close()

    def drain(self) -> tuple[ImuSample, ...]:
        """Return the samples that have arrived since the last call, oldest first."""
        if not self._lease.held:
            return ()
        records = self._lease.it.io.ring("motion").drain()
        if not len(records):
            return ()
        stamps = self._clock.stamps(records, [DOMAINS[domain] for domain in records["domain"].tolist()])
        gyro, accel = ((records[name] @ self._base_from_optical.T).tolist() for name in ("gyro_rad_s", "accel_m_s2"))
        return tuple(map(ImuSample, stamps, map(tuple, gyro), map(tuple, accel)))

    def health(self) -> DeviceHealth:
        """Say how it stands."""
        ring = self._lease.it.io.ring("motion")
        health = health_of(self._setup.name, self._lease, Figure.MOTION_DROPPED)
        period_ns = round(1e9 / self._settings.gyro_rate_hz)
        return replace(health, received=ring.written, overflowed=ring.overflowed, expected_period_ns=period_ns)

    def identity(self) -> DeviceIdentity:
        """Return what the camera has told of itself."""
        return identity_of(self._setup.name, self._lease)
