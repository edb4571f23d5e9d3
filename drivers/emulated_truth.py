"""Ground truth of a world that another process emulates, over loopback."""

from __future__ import annotations

import socket
import threading
import time
from dataclasses import replace
from typing import ClassVar

from pydantic import Field

from drivers.interface.buffers import SampleRing
from drivers.interface.devices import DeviceHealth, DeviceSetup, DeviceState
from drivers.interface.errors import DeviceError
from drivers.interface.samples import TruthSample, merged_truth
from drivers.interface.settings import Settings
from drivers.interface.truth_wire import BYE, LARGEST_DATAGRAM, REFUSED, REPEAT_S, RUN, decode

LOOPBACK = "127.0.0.1"
POLL_S = 0.05


class EmulatedTruthSettings(Settings):
    """Where the emulation is asked."""

    port: int = Field(default=47100, ge=1024, le=65535, description="UDP port on loopback")
    rate_hz: float = Field(default=100.0, gt=0.0, le=1000.0, description="how often the world is looked at")
    open_timeout_s: float = Field(default=10.0, gt=0.0, le=120.0, description="how long the emulation may take to answer")
    buffered_samples: int = Field(default=1000, ge=1, le=100_000, description="looks that are merged into one sample at most")


class EmulatedTruth:
    """Ground truth of the world in `trundle emulate`; opening it lets the scene's walkers set off.

    Its own thread reads the socket and repeats that this run is still there; a run that falls silent has left, and the world is
    made anew.
    """

    Settings: ClassVar[type[Settings]] = EmulatedTruthSettings
    role: ClassVar[str] = "truth"
    real_time: ClassVar[bool] = True
    _newest: TruthSample | None

    def __init__(self, settings: EmulatedTruthSettings, setup: DeviceSetup) -> None:
        """Remember; nothing is sent."""
        self._settings = settings
        self._setup = setup
        self._socket: socket.socket | None = None
        self._thread: threading.Thread | None = None
        self._leave = threading.Event()
        self._reset()

    def open(self) -> None:
        """Announce the run and wait for the first look.

        Raises:
            DeviceError: nobody answers, or another run is under way there.
        """
        self.close()
        self._reset()
        self._offset_ns = self._setup.now_ns() - time.monotonic_ns()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect((LOOPBACK, self._settings.port))
        self._socket.settimeout(POLL_S)
        self._thread = threading.Thread(target=self._listen, args=(self._socket,), name="emulated-truth", daemon=True)
        self._thread.start()
        answered = self._answered.wait(self._settings.open_timeout_s)
        if not answered or self._refused:
            self.close()
            place, name = f"{LOOPBACK}:{self._settings.port}", self._setup.name
            if self._refused:
                raise DeviceError(f"{name}: another run is under way in the emulation at {place}; end it first")
            raise DeviceError(f"{name}: no emulation answers at {place}; start 'trundle emulate' with the same configuration")

    def stop(self) -> None:
        """Do nothing: truth does not move."""

    def close(self) -> None:
        """Say goodbye and let go of the socket."""
        self._leave.set()
        if self._thread is not None:
            self._thread.join()
        if self._socket is not None:
            self._socket.close()
        self._socket = self._thread = None

    def health(self) -> DeviceHealth:
        """Say how it stands."""
        return DeviceHealth(
            device=self._setup.name,
            state=DeviceState.CLOSED if self._thread is None else DeviceState.OPEN,
            received=self._received,
            dropped=self._dropped,
            overflowed=self._ring.overflowed,
            expected_period_ns=round(1e9 / self._settings.rate_hz),
        )

    def latest(self) -> TruthSample | None:
        """Return the truth now, or None before the first; clearance and contacts are those of all looks since the last call."""
        looks = self._ring.drain()
        if looks:
            self._newest = merged_truth(looks)
        return None if self._thread is None else self._newest

    @property
    def world_late_s(self) -> float:
        """For how long the emulated world has stood still since `open` [s]."""
        return (self._late_ns - self._late_at_first_ns) * 1e-9

    def _reset(self) -> None:
        self._leave.clear()
        self._answered = threading.Event()
        self._refused = False
        self._ring: SampleRing[TruthSample] = SampleRing(self._settings.buffered_samples)
        self._newest = None
        self._received = self._dropped = 0
        self._late_ns = self._late_at_first_ns = 0
        self._offset_ns = 0  # of the loop's clock against CLOCK_MONOTONIC, which the emulation stamps with

    def _listen(self, link: socket.socket) -> None:
        """Read until told to leave; runs in the thread."""
        due_s = 0.0
        while not self._leave.is_set():
            if time.monotonic() >= due_s:
                _send(link, RUN)
                due_s = time.monotonic() + REPEAT_S
            try:
                datagram = link.recv(LARGEST_DATAGRAM)
            except TimeoutError:
                continue
            except OSError:  # nobody listens there yet, or any more
                self._leave.wait(POLL_S)
                continue
            self._take(datagram)
        _send(link, BYE)

    def _take(self, datagram: bytes) -> None:
        if datagram == REFUSED:
            self._refused = True
            self._answered.set()
            return
        try:
            look = decode(datagram, time.monotonic_ns() + self._offset_ns)
        except ValueError:
            self._dropped += 1
            return
        if self._received == 0:
            self._late_at_first_ns = look.late_ns
        self._late_ns = look.late_ns
        stamp = replace(look.sample.stamp, captured_ns=look.sample.stamp.captured_ns + self._offset_ns)
        self._ring.put(replace(look.sample, stamp=stamp))
        self._received += 1
        self._answered.set()


def _send(link: socket.socket, word: bytes) -> None:
    try:
        link.send(word)
    except OSError:  # a connected UDP socket reports here that the last datagram found nobody
        return
