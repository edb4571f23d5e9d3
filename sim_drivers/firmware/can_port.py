"""A python-can bus as emulated controllers use it: opened late, never blocking, forgiving."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol

import can

from drivers.interface.errors import DeviceError
from sim_drivers.firmware.can_simple import COMMAND_BITS, COMMAND_MASK, Frame

MOST_A_STEP = 256  # frames that are taken in one step, so that a flood cannot hold up the world


class CanWire(Protocol):
    """Which bus: what python-can's `can.Bus` wants to know."""

    @property
    def bus_arguments(self) -> dict[str, Any]:
        """Keyword arguments of `can.Bus`."""
        ...

    @property
    def place(self) -> str:
        """The bus in a few words."""
        ...


class CanPort:
    """Sends and receives CAN 2.0A frames; what is no such frame is left out."""

    def __init__(self, wire: CanWire, device: str) -> None:
        """Remember; the bus is not touched."""
        self._wire = wire
        self._device = device
        self._bus: can.BusABC | None = None
        self.refused = 0  # frames that the bus would not take, and datagrams that were none

    @property
    def place(self) -> str:
        """The bus in a few words."""
        return self._wire.place

    def open(self) -> None:
        """Join the bus.

        Raises:
            DeviceError: there is none.
        """
        self.close()
        try:
            self._bus = can.Bus(**self._wire.bus_arguments)
        except (can.CanError, OSError, ValueError, ImportError) as error:
            raise DeviceError(f"{self._device}: the CAN bus {self.place} cannot be opened: {error}") from error

    def close(self) -> None:
        """Leave the bus."""
        if self._bus is not None:
            self._bus.shutdown()
        self._bus = None

    def receive(self) -> Iterator[Frame]:
        """Yield what has come, at most `MOST_A_STEP` frames."""
        for _ in range(MOST_A_STEP if self._bus is not None else 0):
            assert self._bus is not None
            try:
                message = self._bus.recv(timeout=0.0)
            except can.CanError:
                self.refused += 1
                continue
            if message is None:
                return
            if message.is_extended_id or message.is_error_frame or message.is_fd:
                continue
            node, command = message.arbitration_id >> COMMAND_BITS, message.arbitration_id & COMMAND_MASK
            # On a multicast bus an axis hears itself; its own reports are data frames, requests are remote or empty ones.
            yield Frame(node, command, bytes(message.data), is_request=message.is_remote_frame or message.dlc == 0)

    def send(self, frame: Frame) -> None:
        """Send a frame; a bus that takes nothing more loses it."""
        if self._bus is None:
            return
        try:
            self._bus.send(can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=False))
        except can.CanError:
            self.refused += 1
