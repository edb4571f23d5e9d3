"""The truth's end in the emulated world: looks at it and tells whoever asks."""

from __future__ import annotations

import socket
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Protocol

from pydantic import Field

from drivers.interface.errors import DeviceError
from drivers.interface.settings import Settings
from drivers.interface.truth_wire import BYE, REFUSED, RUN, WATCH, TruthLook, encode
from sim_drivers.firmware.firmware import FirmwareSetup
from sim_drivers.truth import SimTruth, TruthSettings
from sim_drivers.world import SECOND_NS, MujocoWorld

LOOPBACK = "127.0.0.1"
Address = tuple[str, int]


class TruthWire(Protocol):
    """What both ends must agree on: the settings of the `emulated_truth` driver."""

    @property
    def port(self) -> int:
        """UDP port on loopback."""
        ...

    @property
    def rate_hz(self) -> float:
        """Looks per second."""
        ...


class TruthFirmwareSettings(Settings):
    """When a client is taken for gone."""

    silent_after_s: float = Field(default=3.0, gt=0.3, le=60.0, description="a client that says nothing for so long has left")


@dataclass(slots=True)
class _Client:
    heard_ns: int
    runs: bool


class EmulatedTruthFirmware:
    """Ground truth for other processes.

    The first look that a run gets is that of the tick when its walkers set off.  A run that leaves, or falls silent, ends the
    world; a second run meanwhile is refused.
    """

    Settings: ClassVar[type[Settings]] = TruthFirmwareSettings
    max_step_s = 0.01

    def __init__(self, driver_settings: TruthWire, settings: TruthFirmwareSettings, setup: FirmwareSetup) -> None:
        """Join the world and hold its walkers."""
        self._setup = setup
        self._port = driver_settings.port
        self._silent_ns = round(settings.silent_after_s * SECOND_NS)
        self._period_ns = round(SECOND_NS / driver_settings.rate_hz)
        self._truth = SimTruth(TruthSettings(rate_hz=driver_settings.rate_hz), setup.device())  # joins the world before us
        self._clients: dict[Address, _Client] = {}  # in the order in which they came
        self._socket: socket.socket | None = None
        setup.host.hold()
        setup.world.add(self)

    @property
    def period_ns(self) -> int:
        """How often it looks [ns]."""
        return self._period_ns

    @property
    def listens(self) -> str:
        """The UDP address."""
        return f"UDP {LOOPBACK}:{self._port}"

    def open(self) -> None:
        """Bind the port.

        Raises:
            DeviceError: it is taken.
        """
        self.close()
        link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            link.bind((LOOPBACK, self._port))
        except OSError as error:
            link.close()
            raise DeviceError(
                f"{self._setup.name}: UDP port {self._port} on loopback cannot be bound ({error.strerror}); does another "
                "'trundle emulate' run?"
            ) from error
        link.setblocking(False)
        self._socket = link
        self._truth.open()

    def close(self) -> None:
        """Let go of the port."""
        self._truth.close()
        self._clients.clear()
        if self._socket is not None:
            self._socket.close()
        self._socket = None

    def build(self, spec: Any, base: Any) -> None:
        """Add nothing: truth only looks."""

    def bind(self, world: MujocoWorld) -> None:
        """Look up nothing."""

    def act(self, world: MujocoWorld) -> None:
        """Hear who asks, and tell them how things are."""
        if self._socket is None:
            return
        self._hear(self._socket, world.now_ns)
        sample = self._truth.latest()
        if sample is None or not self._clients:
            return
        shift_ns = self._setup.host.now_ns - world.now_ns
        stamp = replace(sample.stamp, captured_ns=sample.stamp.captured_ns + shift_ns)
        datagram = encode(TruthLook(replace(sample, stamp=stamp), self._setup.host.late_ns))
        for address in self._clients:
            _send(self._socket, datagram, address)

    def _hear(self, link: socket.socket, now_ns: int) -> None:
        while True:
            try:
                word, address = link.recvfrom(64)
            except OSError:  # nothing more
                break
            if word == BYE:
                self._forget(address)
            elif word in (RUN, WATCH):
                self._welcome(link, address, word == RUN, now_ns)
        for address in [a for a, client in self._clients.items() if now_ns - client.heard_ns > self._silent_ns]:
            self._forget(address)

    def _welcome(self, link: socket.socket, address: Address, runs: bool, now_ns: int) -> None:
        known = self._clients.get(address)
        if known is not None:
            known.heard_ns = now_ns
        elif runs and any(client.runs for client in self._clients.values()):
            _send(link, REFUSED, address)
        else:
            self._clients[address] = _Client(now_ns, runs)
            if runs:
                self._setup.host.begin()

    def _forget(self, address: Address) -> None:
        client = self._clients.pop(address, None)
        if client is not None and client.runs:
            self._setup.host.end()


def _send(link: socket.socket, datagram: bytes, address: Address) -> None:
    try:
        link.sendto(datagram, address)
    except OSError:  # its buffer is full, or it is gone: the next look comes soon
        return
