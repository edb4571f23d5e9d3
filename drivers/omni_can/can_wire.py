"""A python-can bus as the session uses it: never blocking, 11-bit frames, each with its age."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import can

from drivers.interface.errors import DeviceError

MOST_A_POLL = 256  # frames, so that a flooded bus cannot hold up a command
OLDEST_NS = 200_000_000  # no frame waited longer: the bus's stamps are wall-clock times, which may jump


class Frame(NamedTuple):
    """A frame as it came."""

    identifier: int
    data: bytes | bytearray
    is_plain: bool  # a data frame with an 11-bit identifier
    age_ns: int  # how long it waited for us


class Wire(Protocol):
    """What a session needs of a bus."""

    def fileno(self) -> int:
        """Return the descriptor that becomes readable, or -1."""
        ...

    def receive(self, now_ns: int) -> Iterator[Frame]:
        """Yield what has come until `now_ns` on CLOCK_MONOTONIC (or a little later), without waiting."""
        ...

    def send(self, identifier: int, data: bytes, request: bool = False) -> None:
        """Send a frame, or a remote one that asks for an answer.  Raises DeviceError when the bus takes nothing."""
        ...

    def close(self) -> None:
        """Leave the bus."""
        ...


@dataclass(frozen=True, slots=True)
class BusChoice:
    """Which bus, as `can.Bus` wants to know it."""

    device: str
    place: str
    arguments: dict[str, Any]


class CanWire:
    """Any bus that python-can knows."""

    def __init__(self, choice: BusChoice) -> None:
        """Join the bus.

        Raises:
            DeviceError: there is none.
        """
        self._choice = choice
        try:
            self._bus = can.Bus(**choice.arguments)
        except (can.CanError, OSError, ValueError, ImportError) as error:
            raise DeviceError(f"{choice.device}: the CAN bus {choice.place} cannot be opened: {error}") from error

    def fileno(self) -> int:
        """Return the bus's descriptor, or -1 where it has none."""
        return int(self._bus.fileno())

    def receive(self, now_ns: int) -> Iterator[Frame]:
        """Yield what has come, at most `MOST_A_POLL` frames.

        Raises:
            DeviceError: the bus is gone.
        """
        stamp_ns = now_ns + time.time_ns() - time.monotonic_ns()  # what the bus's clock said at `now_ns`
        for _ in range(MOST_A_POLL):
            try:
                message = self._bus.recv(0.0)
            except (can.CanError, OSError) as error:
                raise self._lost(error) from error
            if message is None:
                return
            age_ns = min(max(stamp_ns - int(message.timestamp * 1e9), 0), OLDEST_NS)
            plain = not (message.is_extended_id or message.is_remote_frame or message.is_error_frame or message.is_fd)
            yield Frame(message.arbitration_id, message.data, plain, age_ns)

    def send(self, identifier: int, data: bytes, request: bool = False) -> None:
        """Send a frame.

        Raises:
            DeviceError: the bus takes nothing.
        """
        message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False, is_remote_frame=request)
        try:
            self._bus.send(message)
        except (can.CanError, OSError) as error:
            raise self._lost(error) from error

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()

    def _lost(self, error: Exception) -> DeviceError:
        return DeviceError(f"{self._choice.device}: the CAN bus {self._choice.place} is gone: {error}")
