"""A camera on this machine's USB."""

from __future__ import annotations

from typing import Any

from drivers.interface.errors import DeviceError
from drivers.realsense.library import librealsense


class LiveSource:
    """The camera with a serial number, or the only one."""

    is_over = False

    def __init__(self, device: str, serial_number: str) -> None:
        """Look for it, and let its stamps be its own clock's: the system's may jump.

        Raises:
            DeviceError: it is not connected, or there is a choice; lists what is.
        """
        rs = librealsense()
        self._context = rs.context()
        found = {each.get_info(rs.camera_info.serial_number): each for each in self._context.query_devices()}
        names = [f"{each.get_info(rs.camera_info.name)} {serial}" for serial, each in found.items()]
        told = f"connected: {', '.join(names)}" if names else "none is connected"
        if serial_number and serial_number not in found:
            raise DeviceError(f"{device}: there is no RealSense camera with serial number {serial_number}; {told}")
        if not found:
            raise DeviceError(f"{device}: no RealSense camera is connected")
        if not serial_number and len(found) != 1:
            raise DeviceError(f"{device}: serial_number must say which RealSense camera it is; {told}")
        self._device = found[serial_number or next(iter(found))]
        for sensor in self._device.query_sensors():
            if sensor.supports(rs.option.global_time_enabled):
                sensor.set_option(rs.option.global_time_enabled, 0.0)

    @property
    def device(self) -> Any:
        """The camera."""
        return self._device

    def pump(self) -> None:
        """Do nothing: librealsense has threads."""

    def close(self) -> None:
        """Do nothing more: its sensors are closed."""
