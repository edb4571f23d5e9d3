"""An emulated camera's place on the bus: shared memory that can be unplugged, and a clock of its own."""

from __future__ import annotations

from contextlib import suppress
from typing import Generic, TypeVar

from drivers.interface.camera_wire import COUNTER_US, Plug, Wire, path_of
from drivers.interface.errors import DeviceError

W = TypeVar("W", bound=Wire)


class CameraPort(Generic[W]):
    """One part of a camera in shared memory."""

    def __init__(self, kind: type[W], memory: str, part: str, device: str) -> None:
        """Remember; nothing is made."""
        self._kind, self._device = kind, device
        self.path = path_of(memory, part)
        self._plug: Plug[W] | None = None

    @property
    def wire(self) -> W | None:
        """The memory, while it is plugged in."""
        return None if self._plug is None else self._plug.wire

    def open(self) -> W:
        """Plug it in.

        Raises:
            DeviceError: another emulation has a camera of that name, or there is no shared memory.
        """
        self.close()
        try:
            self._plug = Plug(self._kind, self.path)
        except BlockingIOError as error:
            raise DeviceError(f"{self._device}: {self.path} is in use; does another 'trundle emulate' run?") from error
        except OSError as error:
            raise DeviceError(f"{self._device}: {self.path} cannot be made: {error.strerror}") from error
        return self._plug.wire

    def close(self) -> None:
        """Unplug it."""
        plug, self._plug = self._plug, None
        if plug is not None:
            with suppress(OSError):
                plug.pull()


def device_us(host_ns: int, offset_s: float, drift: float) -> int:
    """Return what the camera's counter says at a time of the host.

    >>> device_us(2_000_000_000, 1.0, 1e-6)
    3000002
    """
    return round(host_ns * (1.0 + drift) * 1e-3 + offset_s * 1e6) % COUNTER_US
