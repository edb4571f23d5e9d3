"""A device whose wire is a pair of sockets: it sends numbers, and is sent numbers; the byte 'x' unplugs it."""

import socket
import struct
import time

import numpy as np

from drivers.interface.devices import DeviceState
from drivers.interface.errors import DeviceError
from drivers.interface.settings import Settings
from drivers.io import channels

SAMPLE = np.dtype([("captured_ns", "i8"), ("value", "f8")])
MEMORY = channels.MemorySpec((channels.RingSpec("samples", SAMPLE, 64),), (), 4)


class ToySettings(Settings):
    path: str  # of the other side's socket
    hang: str = ""  # which call never returns
    rest_s: float = 0.0  # how long it takes to rest


class ToySession:
    """Answers each order with its values on the wire; rest is the text 'rest'."""

    def __init__(self, settings: ToySettings, port) -> None:
        self._settings = settings
        self._port = port
        self._wire = None

    def open(self) -> None:
        self._wire = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._wire.connect(self._settings.path)
        self._port.health.state = DeviceState.FAULTED if self._port.reopened else DeviceState.OPEN
        self._port.health.fault = "it waits for a reset" if self._port.reopened else ""
        self._wire.send(b"open")

    def wakes_on(self):
        return (self._wire.fileno(),)

    def next_ns(self, now_ns):
        return now_ns + 1_000_000_000

    def poll(self, now_ns):
        while True:
            try:
                message = self._wire.recv(64, socket.MSG_DONTWAIT)
            except BlockingIOError:
                return
            if message in {b"", b"x"}:
                raise DeviceError("the toy was unplugged")
            if message == b"bug":
                raise ZeroDivisionError("a bug")
            if message == b"hang":
                while True:
                    pass
            self._port.health.received += 1
            self._port.rings["samples"].put((now_ns, *struct.unpack("<d", message)))

    def send(self, values, now_ns):
        self._wire.send(b"order " + values.tobytes())

    def rest(self):
        if self._wire is not None:
            time.sleep(self._settings.rest_s)
            self._wire.send(b"rest")

    def clear_faults(self):
        self._port.health.state, self._port.health.fault = DeviceState.OPEN, ""

    def close(self):
        while self._settings.hang == "close":
            pass
        if self._wire is not None:
            self._wire.close()
        self._wire = None
