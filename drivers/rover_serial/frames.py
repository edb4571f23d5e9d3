"""MAVLink 2 frames out of a stream of bytes: found, checked, and found again after damage.

Source: MAVLink developer guide, Packet Serialization.  pymavlink's own parser skips as many bytes as a damaged header claims and
loses the good frames among them; here only one byte is skipped.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as dialect

STX, STX_1 = 0xFD, 0xFE
HEADER, HEADER_1, CHECKSUM, SIGNATURE = 10, 6, 2, 13
SIGNED = 0x01  # incompatibility flag
_HEADER = struct.Struct("<BBBBBBBHB")
CRC_EXTRA: Mapping[int, int] = {number: kind.crc_extra for number, kind in dialect.mavlink_map.items()}


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame whose checksum is right; `raw` is all of it, with the signature where there is one."""

    system: int
    component: int
    sequence: int
    message_id: int
    payload: bytes  # as sent: trailing zeros may have been cut off
    raw: bytes
    signed: bool


def checksum(data: bytes, crc_extra: int) -> int:
    """Return the CRC-16/MCRF4XX of a frame without its first byte, and of its message's CRC_EXTRA.

    >>> hex(checksum(b"123456789"[:-1], ord("9")))  # the catalogue's check value
    '0x6f91'
    """
    return int(dialect.x25crc(data + bytes((crc_extra,))).crc)


class Framer:
    """Takes bytes, gives frames."""

    def __init__(self) -> None:
        """Start with none."""
        self._buffer = bytearray()
        self.damaged = 0  # frames whose checksum was wrong
        self.older = 0  # whole MAVLink 1 frames

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that are complete now.  Those of messages that we do not know come unchecked."""
        buffer, frames, at = self._buffer, [], 0
        buffer += data
        while True:
            at = self._start(at)
            taken, frame = self._frame(at)
            if taken == 0:
                break
            at += taken
            if frame is not None:
                frames.append(frame)
        del buffer[:at]
        return frames

    def _start(self, at: int) -> int:
        """Return where the next frame may start."""
        buffer = self._buffer
        while at < len(buffer) and buffer[at] != STX and buffer[at] != STX_1:
            at += 1
        return at

    def _frame(self, at: int) -> tuple[int, Frame | None]:
        """Return how many bytes to go on by (0: more are needed) and the frame at this place, if it is one."""
        buffer = self._buffer
        if at < len(buffer) and buffer[at] == STX_1:
            return self._older(at), None
        if len(buffer) - at < HEADER:
            return 0, None
        _, length, incompatible, _, sequence, system, component, low, high = _HEADER.unpack_from(buffer, at)
        if incompatible & ~SIGNED:
            return 1, None
        signed = bool(incompatible & SIGNED)
        end = at + HEADER + length + CHECKSUM
        whole = end + SIGNATURE * signed
        if len(buffer) < whole:
            return 0, None
        message_id = low | high << 16
        raw = bytes(buffer[at:whole])
        extra = CRC_EXTRA.get(message_id)
        if extra is None:
            follows = whole == len(buffer) or buffer[whole] in (STX, STX_1)
            if not follows:
                return 1, None
        elif checksum(raw[1 : end - at - CHECKSUM], extra) != int.from_bytes(raw[end - at - CHECKSUM : end - at], "little"):
            self.damaged += 1
            return 1, None
        return whole - at, Frame(system, component, sequence, message_id, raw[HEADER : HEADER + length], raw, signed)

    def _older(self, at: int) -> int:
        buffer = self._buffer
        if len(buffer) - at < HEADER_1:
            return 0
        length, extra = buffer[at + 1], CRC_EXTRA.get(buffer[at + 5])
        end = at + HEADER_1 + length + CHECKSUM
        if extra is None:
            return 1
        if len(buffer) < end:
            return 0
        raw = bytes(buffer[at:end])
        if checksum(raw[1:-CHECKSUM], extra) != int.from_bytes(raw[-CHECKSUM:], "little"):
            return 1
        self.older += 1
        return end - at


class SequenceCounter:
    """Frames that one sender has sent and we did not get."""

    def __init__(self) -> None:
        """Start with the next frame."""
        self._last: int | None = None

    def lost_before(self, sequence: int) -> int:
        """Return how many were lost between the frame before and this one.

        >>> counter = SequenceCounter()
        >>> [counter.lost_before(sequence) for sequence in (254, 255, 0, 3)]
        [0, 0, 0, 2]
        """
        last, self._last = self._last, sequence
        return 0 if last is None else (sequence - last - 1) & 0xFF
