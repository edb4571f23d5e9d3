"""The life of a device whose wire is a process of its own; a driver adds what is said over the wire."""

from __future__ import annotations

from typing import ClassVar

from drivers.interface.devices import DeviceHealth, DeviceIdentity, DeviceSetup
from drivers.interface.samples import Stamp
from drivers.interface.shared_ring import Records
from drivers.io.host_clock import HostClock
from drivers.io.process import IoProcess, IoSpec


class WireDevice:
    """Has one process at the wire, and one ring of samples in its memory."""

    real_time: ClassVar[bool] = True
    what: ClassVar[str] = ""  # kind of thing answers

    def __init__(self, setup: DeviceSetup, spec: IoSpec, ring: str, period_ns: int) -> None:
        """Remember; nothing is touched.  The ring's samples come every `period_ns`."""
        self._setup = setup
        self._clock = HostClock(setup.now_ns)
        self._io = IoProcess(spec)
        self._ring = ring
        self._period_ns = period_ns

    def open(self) -> None:
        """Connect, and wait until the device has answered; nothing moves.

        Raises:
            DeviceError: it is not there, not what is needed, or refuses; says why in one sentence.
        """
        self._setup.now_ns()  # a clock that fails must fail before there is a process
        self._io.open()

    def stop(self) -> None:
        """Come to rest."""
        self._io.stop()

    def close(self) -> None:
        """Come to rest and let go of the wire."""
        self._io.close()

    def clear_faults(self) -> None:
        """Do the operator's reset: afterwards the device takes commands again, or says why not."""
        self._io.clear_faults()

    def health(self) -> DeviceHealth:
        """Say how it stands."""
        return self._io.health().of_device(self._setup.name, self._period_ns, self._io.ring(self._ring))

    def identity(self) -> DeviceIdentity:
        """Return what it has told of itself."""
        return self._io.health().identity(self._setup.name, self.what)

    def _drained(self) -> tuple[list[Stamp], Records] | None:
        """Return the records since the last call with their stamps, or None."""
        if not self._io.is_open:
            return None
        records = self._io.ring(self._ring).drain()
        return (self._clock.stamps(records), records) if len(records) else None
