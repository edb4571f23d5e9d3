"""The depth camera, as the loop sees it."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from drivers.interface.devices import DeviceHealth, DeviceIdentity, DeviceSetup
from drivers.interface.geometry import BODY_FROM_OPTICAL, SE3
from drivers.interface.samples import ColourFrame, DepthFrame, Intrinsics, Stamp, frozen_array
from drivers.interface.settings import Settings
from drivers.io.host_clock import HostClock
from drivers.realsense.link import health_of, identity_of, link_of
from drivers.realsense.plan import DOMAINS, Figure
from drivers.realsense.settings import CameraSettings


class RealSenseCamera:
    """A RealSense's depth through librealsense's filters; they hold the interpreter lock, so a process of its own does it."""

    Settings: ClassVar[type[Settings]] = CameraSettings
    role: ClassVar[str] = "camera"
    real_time: ClassVar[bool] = True

    def __init__(self, settings: CameraSettings, setup: DeviceSetup) -> None:
        """Remember; the camera is not touched."""
        self._settings = settings
        self._setup = setup
        mount = (settings.x_m, settings.y_m, settings.z_m, settings.roll_rad, settings.pitch_rad, settings.yaw_rad)
        self._base_from_optical = SE3.from_euler(*mount) @ BODY_FROM_OPTICAL
        self._clock = HostClock(setup.now_ns)
        self._lease = link_of(settings, setup)

    def open(self) -> None:
        """Start the camera and wait for its first frame.

        Raises:
            ConfigurationError: there is no such recording.
            DeviceError: no such camera, or it sends nothing.
        """
        self._setup.now_ns()
        self._lease.open()

    def stop(self) -> None:
        """Do nothing: a camera does not move."""

    def close(self) -> None:
        """Let go of the camera."""
        self._lease.close()

    def latest(self) -> DepthFrame | None:
        """Return the newest frame not yet returned, or None."""
        taken = self._lease.it.io.frame("depth").take() if self._lease.held else None
        if taken is None:
            return None
        meta, pixels = taken
        captured_ns, received_ns, sequence, domain, width, height, fx, fy, cx, cy, unit_m = meta.item()
        depth = frozen_array(pixels.view(np.uint16).reshape(height, width))
        intrinsics = Intrinsics(width, height, fx, fy, cx, cy)
        stamp = self._stamp(captured_ns, received_ns, sequence, domain)
        return DepthFrame(stamp, depth, unit_m, intrinsics, self._base_from_optical)

    def latest_colour(self) -> ColourFrame | None:
        """Return the newest picture not yet returned, or None."""
        taken = self._lease.it.io.frame("colour").take() if self._lease.held else None
        if taken is None:
            return None
        meta, jpeg = taken
        return ColourFrame(self._stamp(*meta.item()), jpeg.tobytes())

    def health(self) -> DeviceHealth:
        """Say how it stands."""
        slot = self._lease.it.io.frame("depth")
        health = health_of(self._setup.name, self._lease, Figure.DEPTH_DROPPED)
        period_ns = round(1e9 / self._settings.rate_hz)
        return replace(health, received=slot.written, overflowed=slot.overwritten, expected_period_ns=period_ns)

    def identity(self) -> DeviceIdentity:
        """Return what the camera has told of itself."""
        return identity_of(self._setup.name, self._lease)

    def _stamp(self, captured_ns: int, received_ns: int, sequence: int, domain: int) -> Stamp:
        offset_ns = self._clock.offset_ns()
        return Stamp(captured_ns + offset_ns, received_ns + offset_ns, sequence, DOMAINS[domain])
