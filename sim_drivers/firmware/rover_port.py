"""The wire of an emulated autopilot: a TCP server, a UDP peer, or a pseudo-terminal under the path of a serial port."""

from __future__ import annotations

import contextlib
import os
import pty
import socket
import tty
from typing import Protocol

from drivers.interface.errors import DeviceError

MOST_A_STEP = 16_384  # bytes


class Where(Protocol):
    """A parsed place: what both ends must agree on."""

    @property
    def kind(self) -> str:
        """serial, tcp, udp (we listen) or udpin (the host does)."""
        ...

    @property
    def host(self) -> str:
        """Host, or the path of the serial port."""
        ...

    @property
    def number(self) -> int:
        """Port, or baud rate."""
        ...


class RoverPort:
    """Bytes to and from whoever is connected; what nobody takes is lost."""

    def __init__(self, where: Where, device: str) -> None:
        """Remember; nothing is bound."""
        self._where, self._device = where, device
        self._server: socket.socket | None = None  # TCP: what listens
        self._link: socket.socket | None = None
        self._terminal: tuple[int, int] | None = None  # pseudo-terminal: our end, and the other, kept open
        self._peer: tuple[str, int] | None = None

    @property
    def listens(self) -> str:
        """Where, in a few words."""
        where = self._where
        return f"MAVLink 2 on {where.host}" if where.kind == "serial" else f"MAVLink 2, {where.kind} {where.host}:{where.number}"

    def open(self) -> None:
        """Bind it.

        Raises:
            DeviceError: it cannot be bound.
        """
        self.close()
        where = self._where
        try:
            if where.kind == "serial":
                self._open_terminal(where.host)
            elif where.kind == "tcp":
                self._server = socket.create_server((where.host, where.number))
                self._server.setblocking(False)
            else:
                self._link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
                self._link.setblocking(False)
                if where.kind == "udp":
                    self._link.bind((where.host, where.number))
                else:
                    self._peer = (where.host, where.number)
        except OSError as error:
            self.close()
            raise DeviceError(f"{self._device}: {self.listens} cannot be bound: {error}") from error

    def close(self) -> None:
        """Let go of it, in every state."""
        for end in (self._link, self._server):
            if end is not None:
                end.close()
        if self._terminal is not None:
            for descriptor in self._terminal:
                os.close(descriptor)
            with contextlib.suppress(OSError):
                os.unlink(self._where.host)
        self._link = self._server = self._terminal = self._peer = None

    def cut(self) -> None:
        """Cut the connection; who wants may connect again."""
        if self._server is not None and self._link is not None:
            self._link.close()
            self._link = None

    def receive(self) -> bytes:
        """Return what has come, without waiting."""
        try:
            if self._terminal is not None:
                return os.read(self._terminal[0], MOST_A_STEP)
            if self._server is not None:
                return self._receive_stream(self._server)
            if self._link is not None:
                data, self._peer = self._link.recvfrom(MOST_A_STEP)
                return data
        except OSError:  # nothing has come, or who was connected is gone
            pass
        return b""

    def send(self, data: bytes) -> None:
        """Send it, if somebody is there; a full buffer loses it."""
        with contextlib.suppress(OSError):
            if self._terminal is not None:
                os.write(self._terminal[0], data)
            elif self._link is not None and self._server is not None:
                self._link.send(data)
            elif self._link is not None and self._peer is not None:
                self._link.sendto(data, self._peer)

    def _receive_stream(self, server: socket.socket) -> bytes:
        with contextlib.suppress(BlockingIOError):
            link, _ = server.accept()
            if self._link is not None:
                self._link.close()  # the newer one counts
            link.setblocking(False)
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._link = link
        if self._link is None:
            return b""
        data = self._link.recv(MOST_A_STEP)
        if not data:
            self._link.close()
            self._link = None
        return data

    def _open_terminal(self, path: str) -> None:
        ours, theirs = pty.openpty()
        self._terminal = (ours, theirs)
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        with contextlib.suppress(FileNotFoundError):
            if os.path.islink(path):  # left behind by an emulation that was killed; nothing else is replaced
                os.unlink(path)
        os.symlink(os.ttyname(theirs), path)
