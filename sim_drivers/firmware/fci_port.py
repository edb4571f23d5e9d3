"""The controller's end of the wire: TCP for requests of one client, UDP for its states and commands.  Nothing waits."""

from __future__ import annotations

import select
import socket
import struct
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np

from drivers.interface.errors import DeviceError
from sim_drivers.firmware.fci_protocol import (
    COMMAND,
    HEADER,
    INCOMPATIBLE_VERSION,
    LARGEST_REQUEST,
    PORT,
    SUCCESS,
    VERSION,
    Asked,
    Request,
    reply,
)

Command = np.ndarray[Any, np.dtype[np.void]]  # (1,)


class FciPort:
    """Listens on one loopback address; a second client is turned away."""

    def __init__(self, device: str, host: str) -> None:
        """Remember; nothing is bound."""
        self._device = device
        self._host = host
        self._listener: socket.socket | None = None
        self._client: socket.socket | None = None
        self._link: socket.socket | None = None
        self._heard = b""
        self._target: tuple[str, int] | None = None  # where the states go
        self.version = VERSION

    @property
    def place(self) -> str:
        """Where it listens."""
        return f"TCP {self._host}:{PORT}"

    @property
    def is_connected(self) -> bool:
        """Whether a client has said what protocol it speaks."""
        return self._target is not None

    def open(self) -> None:
        """Bind both sockets.

        Raises:
            DeviceError: the port is taken.
        """
        self.close()
        self._listener, self._link = socket.socket(), socket.socket(type=socket.SOCK_DGRAM)
        try:
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._listener.bind((self._host, PORT))
            self._listener.listen(1)
            self._link.bind((self._host, 0))
        except OSError as error:
            self.close()
            raise DeviceError(
                f"{self._device}: {self.place} cannot be bound ({error.strerror}); does another 'trundle emulate' run?"
            ) from error
        self._listener.setblocking(False)
        self._link.setblocking(False)

    def close(self) -> None:
        """Let go of everything."""
        self.disconnect()
        for bound in (self._listener, self._link):
            if bound is not None:
                bound.close()
        self._listener = self._link = None

    def disconnect(self) -> None:
        """Hang up on the client."""
        if self._client is not None:
            self._client.close()
        self._client, self._target, self._heard = None, None, b""

    def requests(self) -> Iterator[Asked]:
        """Yield what the client has asked; connecting is answered here."""
        self._hear()  # who has left makes room
        self._accept()
        while len(self._heard) >= HEADER.size:
            number, identity, size = HEADER.unpack_from(self._heard)
            if number not in Request.__members__.values() or not HEADER.size <= size <= LARGEST_REQUEST:
                self.disconnect()  # that is no client of this interface
                return
            if len(self._heard) < size:
                return
            asked = Asked(Request(number), identity, self._heard[HEADER.size : size])
            self._heard = self._heard[size:]
            if asked.request is Request.CONNECT:
                self._connect(asked)
            else:
                yield asked

    def answer(self, asked: Asked, status: int, more: bytes = b"") -> None:
        """Answer a request."""
        if self._client is None:
            return
        try:
            self._client.setblocking(True)
            self._client.sendall(reply(asked.request, asked.identity, status, more))
            self._client.setblocking(False)
        except OSError:
            self.disconnect()

    def send(self, state: bytes) -> None:
        """Send a state."""
        if self._link is not None and self._target is not None:
            with suppress(OSError):  # nobody listens there any more: TCP will tell
                self._link.sendto(state, self._target)

    def commands(self) -> Iterator[Command]:
        """Yield the motion commands that have come."""
        while self._link is not None:
            try:
                datagram, address = self._link.recvfrom(2048)
            except OSError:  # nothing more
                return
            if address == self._target and len(datagram) == COMMAND.itemsize:
                yield np.frombuffer(datagram, COMMAND)

    def wait(self, seconds: float) -> bool:
        """Wait for the client, at most so long; return whether it has said something."""
        open_ones = [each for each in (self._listener, self._client, self._link) if each is not None]
        return bool(select.select(open_ones, (), (), seconds)[0])

    def _accept(self) -> None:
        if self._listener is None:
            return
        with suppress(BlockingIOError):
            client, _ = self._listener.accept()
            if self._client is not None:
                client.close()
                return
            client.setblocking(False)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._client = client
            self._hear()

    def _hear(self) -> None:
        if self._client is None:
            return
        try:
            heard = self._client.recv(LARGEST_REQUEST)
        except BlockingIOError:
            return
        except OSError:
            heard = b""
        if not heard:
            self.disconnect()
        self._heard += heard

    def _connect(self, asked: Asked) -> None:
        version, port = struct.unpack("<HH", asked.payload) if asked.well_formed else (0, 0)
        good = version == self.version
        self.answer(asked, SUCCESS if good else INCOMPATIBLE_VERSION, struct.pack("<H", self.version))
        if good and self._client is not None:
            self._target = (self._client.getpeername()[0], port)
