"""The bytes to and from an autopilot; never blocking."""

from __future__ import annotations

import socket
from typing import Protocol

import serial

from drivers.interface.errors import DeviceError
from drivers.rover_serial.place import Place

CONNECT_S = 2.0
MOST_A_POLL = 65_536  # bytes, so that a flooded wire cannot hold up a command


class Wire(Protocol):
    """What a session needs of a wire."""

    def fileno(self) -> int:
        """Return the descriptor that becomes readable, or -1."""
        ...

    def receive(self) -> bytes:
        """Return what has come, without waiting.  Raises DeviceError or OSError when the wire is gone."""
        ...

    def send(self, data: bytes) -> None:
        """Send all of it now; what cannot go at once would arrive too late.  Raises DeviceError or OSError."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


class SerialWire:
    """A serial port or pseudo-terminal, for us alone."""

    def __init__(self, place: Place) -> None:
        """Open it.

        Raises:
            OSError: there is none, or another program has it.
        """
        self._port = serial.Serial(place.host, place.number, timeout=0, write_timeout=0, exclusive=True)

    def fileno(self) -> int:
        """Return the descriptor."""
        return int(self._port.fileno())

    def receive(self) -> bytes:
        """Return what has come."""
        return bytes(self._port.read(MOST_A_POLL))

    def send(self, data: bytes) -> None:
        """Send all of it.

        Raises:
            DeviceError: the line takes nothing more.
        """
        if self._port.write(data) != len(data):
            raise DeviceError("the line takes nothing more")

    def close(self) -> None:
        """Let go of it."""
        self._port.close()


class StreamWire:
    """A TCP connection."""

    def __init__(self, place: Place) -> None:
        """Connect.

        Raises:
            OSError: nobody listens there.
        """
        self._socket = socket.create_connection((place.host, place.number), CONNECT_S)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.setblocking(False)

    def fileno(self) -> int:
        """Return the descriptor."""
        return self._socket.fileno()

    def receive(self) -> bytes:
        """Return what has come.

        Raises:
            DeviceError: the other end has closed it.
        """
        try:
            data = self._socket.recv(MOST_A_POLL)
        except BlockingIOError:
            return b""
        if not data:
            raise DeviceError("the connection was closed by the other end")
        return data

    def send(self, data: bytes) -> None:
        """Send all of it.

        Raises:
            DeviceError: the other end takes nothing more.
        """
        if self._socket.send(data) != len(data):
            raise DeviceError("the connection takes nothing more")

    def close(self) -> None:
        """Let go of it."""
        self._socket.close()


class DatagramWire:
    """UDP: to a peer that listens, or from whoever speaks to us first."""

    def __init__(self, place: Place) -> None:
        """Take a socket.

        Raises:
            OSError: the address is taken or not ours.
        """
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        address = (place.host, place.number)
        self._peer: tuple[str, int] | None = None
        if place.kind == "udpin":
            self._socket.bind(address)
        else:
            self._peer = address
            self._socket.connect(address)

    def fileno(self) -> int:
        """Return the descriptor."""
        return self._socket.fileno()

    def receive(self) -> bytes:
        """Return what has come from the peer."""
        parts: list[bytes] = []
        while sum(map(len, parts)) < MOST_A_POLL:
            try:
                data, address = self._socket.recvfrom(2048)
            except (BlockingIOError, ConnectionRefusedError):  # nothing more, or nobody listens there yet
                break
            self._peer = self._peer or address
            if address == self._peer:
                parts.append(data)
        return b"".join(parts)

    def send(self, data: bytes) -> None:
        """Send it, if there is a peer yet."""
        if self._peer is None:
            return
        try:
            self._socket.sendto(data, self._peer)
        except ConnectionRefusedError:  # nobody listens there yet, or any more: the silence tells
            return

    def close(self) -> None:
        """Let go of it."""
        self._socket.close()


def open_wire(place: Place) -> Wire:
    """Open the wire to a place.

    Raises:
        OSError: it cannot be opened.
    """
    if place.kind == "serial":
        return SerialWire(place)
    return StreamWire(place) if place.kind == "tcp" else DatagramWire(place)
