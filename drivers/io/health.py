"""What the process at the wire says of itself and of its device."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from drivers.interface.devices import DeviceHealth, DeviceIdentity, DeviceState
from drivers.interface.shared_memory import Block, Seqlock
from drivers.interface.shared_ring import SharedRing

FIGURES = 32
PLACES = 2  # of the record: one is whole while the other is written
STATES = tuple(DeviceState)
_TEXT = {"fault": 400, "firmware": 64, "protocol": 64, "serial": 64}  # bytes


@dataclass(slots=True)
class HealthRecord:
    """The child fills it, the shell publishes it, the host reads it.  A number that is not known is NaN, a text empty."""

    state: DeviceState = DeviceState.CLOSED
    fault: str = ""  # one sentence
    received: int = 0
    dropped: int = 0  # failed its checksum, counter or range check, or lost on the way
    foreign: int = 0  # came from someone else and was ignored
    expired_commands: int = 0  # times the dead man acted
    reconnects: int = 0
    resets_done: int = 0  # the number of the last reset that was carried out
    battery_fraction: float = math.nan
    battery_v: float = math.nan
    bus_load: float = math.nan  # share of the wire's bit rate
    firmware: str = ""
    protocol: str = ""
    serial: str = ""
    figures: list[float] = field(default_factory=lambda: [math.nan] * FIGURES)  # what else the device's doctor asks, in its order

    def of_device(self, name: str, expected_period_ns: int, *rings: SharedRing) -> DeviceHealth:
        """Return how the device of this name stands, whose samples come through these rings."""
        return DeviceHealth(
            device=name,
            state=self.state,
            fault=self.fault,
            received=sum(ring.written for ring in rings),
            dropped=self.dropped,
            overflowed=sum(ring.overflowed for ring in rings),
            expired_commands=self.expired_commands,
            expected_period_ns=expected_period_ns,
            battery_fraction=_known(self.battery_fraction),
            battery_v=_known(self.battery_v),
            bus_load=_known(self.bus_load),
        )

    def identity(self, name: str, model: str) -> DeviceIdentity:
        """Return what the device of this name has told of itself."""
        return DeviceIdentity(name, model, self.firmware, self.protocol, self.serial)


def _type_of(name: str, annotation: str) -> tuple[str, str] | tuple[str, str, tuple[int]]:
    if name == "figures":
        return (name, "f8", (FIGURES,))
    return (name, {"str": f"S{_TEXT.get(name, 0)}", "float": "f8"}.get(annotation, "i8"))


_NAMES = tuple(f.name for f in fields(HealthRecord))
DTYPE = np.dtype([_type_of(f.name, str(f.type)) for f in fields(HealthRecord)])


class HealthBlock:
    """A health record in shared memory, and the child's heartbeat.

    There are two places, written in turn: the newest record stays whole when its writer is killed while it writes the next.
    """

    def __init__(self, block: Block) -> None:
        """Take the block's place in the memory."""
        self._heartbeat = block.words(1)
        self._published = block.words(1)  # how many records
        self._locks = [Seqlock(block.words(1)) for _ in range(PLACES)]
        self._records = [block.array(DTYPE, 1) for _ in range(PLACES)]
        self._seen = 0  # nothing published yet
        self._newest = HealthRecord()

    @property
    def heartbeat_ns(self) -> int:
        """When the child last went round its loop, on CLOCK_MONOTONIC; 0: not yet."""
        return int(self._heartbeat[0])

    def beat(self, now_ns: int) -> None:
        """Say that the child lives."""
        self._heartbeat[0] = now_ns

    def publish(self, health: HealthRecord) -> None:
        """Write the whole record."""
        row = tuple(_packed(getattr(health, name)) for name in _NAMES)
        count = self._published[0] + 1
        place = count % PLACES
        self._locks[place].begin()
        self._records[place][0] = row
        self._locks[place].end()
        self._published[0] = count

    def read(self) -> HealthRecord:
        """Return the newest whole record; the same object until there is another."""
        count = self._published[0]
        place = count % PLACES
        if count != self._seen and (rows := self._locks[place].read(self._records[place].copy)) is not None:
            self._newest, self._seen = _unpacked(rows[0].item()), count
        return self._newest


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


def _packed(value: object) -> object:
    if isinstance(value, DeviceState):
        return STATES.index(value)
    return value.encode()[: _TEXT["fault"]] if isinstance(value, str) else value


def _unpacked(row: tuple[Any, ...]) -> HealthRecord:
    values = dict(zip(_NAMES, row, strict=True))
    for name in _TEXT:
        values[name] = values[name].decode(errors="replace")
    values["state"] = STATES[values["state"]]
    values["figures"] = values["figures"].tolist()
    return HealthRecord(**values)
