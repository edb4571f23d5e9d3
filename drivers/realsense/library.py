"""librealsense for Python, made to load without libusb installed in the system."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from drivers.interface.errors import DeviceError


@cache
def librealsense() -> Any:
    """Return the module `pyrealsense2`, which finds its libusb among the symbols that were loaded before it.

    Raises:
        DeviceError: it is not installed.
    """
    try:
        import libusb_package  # noqa: PLC0415 - an optional extra, and only the process at the camera needs it

        ctypes.CDLL(str(libusb_package.get_library_path()), ctypes.RTLD_GLOBAL)
        import pyrealsense2  # noqa: PLC0415
    except (ImportError, OSError) as error:
        raise DeviceError(f"librealsense cannot be loaded ({error}); install 'trundle[realsense]'") from error
    return pyrealsense2


@contextmanager
def device_errors(device: str) -> Iterator[None]:
    """Turn librealsense's errors, which are RuntimeErrors, into a DeviceError with the device's name."""
    try:
        yield
    except RuntimeError as error:
        raise DeviceError(f"{device}: librealsense says: {str(error).strip() or type(error).__name__}") from error
