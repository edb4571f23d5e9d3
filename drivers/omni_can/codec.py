"""CAN payloads by `struct`: a message is compiled once, since cantools takes tens of microseconds a frame."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

COMMAND_BITS = 5  # the identifier is node << 5 | command
COMMAND_MASK = (1 << COMMAND_BITS) - 1
Number = int | float


@dataclass(frozen=True, slots=True)
class Signal:
    """A little-endian field of a payload."""

    name: str
    start_bit: int
    bits: int
    kind: str  # "u" unsigned, "s" signed, "f" IEEE 754
    names: Mapping[int, str] = field(default_factory=dict)  # what its values, or its bits, are called


@dataclass(frozen=True)
class Message:
    """One message of a node: its command number and its signals, in the order of their bits."""

    name: str
    command: int
    length: int  # bytes
    signals: tuple[Signal, ...]

    def decode(self, data: bytes | bytearray) -> tuple[Number, ...]:
        """Return the signals' values; the payload has the message's length."""
        if self._packed is not None:
            return self._packed.unpack(data)
        word = int.from_bytes(data, "little")
        return tuple(_extract(word, signal) for signal in self.signals)

    def encode(self, *values: Number) -> bytes:
        """Return the payload for values in the order of the signals."""
        if self._packed is not None:
            return self._packed.pack(*values)
        word = sum((int(v) & (1 << s.bits) - 1) << s.start_bit for v, s in zip(values, self.signals, strict=True))
        return word.to_bytes(self.length, "little")

    def index(self, signal: str) -> int:
        """Return where a signal's value stands among the decoded ones."""
        return [s.name for s in self.signals].index(signal)

    def __getstate__(self) -> dict[str, object]:
        """Leave the compiled format out: it cannot be pickled."""
        return {key: value for key, value in self.__dict__.items() if key != "_packed"}

    @cached_property
    def _packed(self) -> struct.Struct | None:
        """The payload as a `struct`, where every signal fills whole bytes."""
        code, bit = "<", 0
        for signal in self.signals:
            letter = _LETTERS.get((signal.kind, signal.bits))
            if letter is None or signal.start_bit < bit or signal.start_bit % 8:
                return None
            code += "x" * ((signal.start_bit - bit) // 8) + letter
            bit = signal.start_bit + signal.bits
        return struct.Struct(code + "x" * (self.length - bit // 8))


Codec = Mapping[str, Message]  # by name

_LETTERS = {
    ("f", 32): "f", ("f", 64): "d",
    ("u", 8): "B", ("u", 16): "H", ("u", 32): "I", ("u", 64): "Q",
    ("s", 8): "b", ("s", 16): "h", ("s", 32): "i", ("s", 64): "q",
}  # fmt: skip


def _extract(word: int, signal: Signal) -> Number:
    raw = word >> signal.start_bit & (1 << signal.bits) - 1
    if signal.kind == "f":
        return float(struct.unpack("<f", raw.to_bytes(4, "little"))[0])
    return raw - (1 << signal.bits) if signal.kind == "s" and raw >> (signal.bits - 1) else raw


def bit_names(word: int, names: Mapping[int, str]) -> str:
    """Return what the set bits of a word are called.

    >>> bit_names(0x801, {1: "INVALID_STATE", 2048: "WATCHDOG_TIMER_EXPIRED"})
    'INVALID_STATE, WATCHDOG_TIMER_EXPIRED'
    >>> bit_names(4, {1: "INVALID_STATE"})
    'bit 2'
    """
    bits = [bit for bit in range(word.bit_length()) if word >> bit & 1]
    return ", ".join(names.get(1 << bit, f"bit {bit}") for bit in bits)
