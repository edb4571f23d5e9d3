"""The contract of where frames come from: whatever it is, librealsense sees a device with sensors."""

from __future__ import annotations

from typing import Any, Protocol


class Source(Protocol):
    """An opened device.  Its methods may raise DeviceError, or librealsense's RuntimeError."""

    @property
    def device(self) -> Any:
        """The `rs.device`, its sensors not yet opened."""
        ...

    @property
    def is_over(self) -> bool:
        """Whether it is a recording that has been played to its end."""
        ...

    def pump(self) -> None:
        """Pass on what has come, where librealsense has no thread of its own for that; never waits.

        Raises:
            DeviceError: it was unplugged.
        """
        ...

    def close(self) -> None:
        """Let go of it; its sensors are closed."""
        ...
