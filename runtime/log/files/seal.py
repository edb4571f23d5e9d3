"""Whether a file of a log is, byte for byte, as it was written: read without Rerun's reader, which some damage makes abort.

The mark at the end of a file holds how many bytes are before it, and their CRC-32.  It is one message of Rerun's own format: its
kind and its length (two little-endian 64-bit numbers), then a protobuf `ArrowMsg`, whose payload is an Arrow stream packed with
LZ4.  That stream is searched and not decoded, as Arrow's reader may crash on damage, too.
"""

from __future__ import annotations

import enum
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import pyarrow as pa

from runtime.log.files.marks import END

_HEAD = struct.Struct("<QQ")
_INTEGER = struct.Struct("<q")  # as the columns of the mark hold it
_ARROW = 2  # kind of a message with a chunk in it
_TAIL_BYTES = 1 << 14  # the mark takes some 1300
_LARGEST_BYTES = 1 << 16  # of an unpacked mark
_BLOCK_BYTES = 1 << 22
_COMPRESSION, _SIZE, _PAYLOAD = 2, 3, 5  # numbers of the fields of ArrowMsg
_VARINT, _FIXED64, _BYTES = 0, 1, 2  # protobuf's wire types
_LZ4 = 2


class Seal(enum.Enum):
    """How a file of a log stands."""

    WHOLE = enum.auto()
    OPEN = enum.auto()  # no mark: its writer was killed, or it was cut off
    BROKEN = enum.auto()  # not as it was written


def seal_of(file: Path) -> Seal:
    """Return whether a file has its mark at the end, and the mark's checksum fits all that stands before it."""
    size = file.stat().st_size
    with file.open("rb") as source:
        source.seek(max(0, size - _TAIL_BYTES))
        tail = source.read()
    mark = _last_message(tail)
    content = _unpacked(mark) if mark is not None else b""
    if mark is None or END.encode() not in content:
        return Seal.OPEN
    before = size - len(mark) - _HEAD.size
    fits = all(_INTEGER.pack(said) in content for said in (before, crc32_of(file, before)))
    return Seal.WHOLE if fits else Seal.BROKEN


def crc32_of(file: Path, size: int) -> int:
    """Return the CRC-32 of the first bytes of a file."""
    crc32 = 0
    with file.open("rb") as source:
        while size > 0 and (block := source.read(min(size, _BLOCK_BYTES))):
            crc32, size = zlib.crc32(block, crc32), size - len(block)
    return crc32


def _last_message(tail: bytes) -> bytes | None:
    """Return what the file's last message carries; None: it does not end with a whole one."""
    for begin in range(len(tail) - _HEAD.size, -1, -1):
        kind, length = _HEAD.unpack_from(tail, begin)
        if kind == _ARROW and begin + _HEAD.size + length == len(tail):
            return tail[begin + _HEAD.size :]
    return None


def _unpacked(message: bytes) -> bytes:
    """Return the Arrow stream in a message; empty: it is damaged."""
    try:
        fields = dict(_fields(message))
        payload, size = fields[_PAYLOAD], fields[_SIZE]
        if fields[_COMPRESSION] != _LZ4 or isinstance(payload, int) or isinstance(size, bytes) or size > _LARGEST_BYTES:
            return b""
        unpacked: bytes = pa.decompress(payload, size, "lz4_raw", asbytes=True)
    except (pa.ArrowException, OSError, LookupError, TypeError, ValueError):
        return b""
    return unpacked


def _fields(message: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Yield number and value of each field of a protobuf message."""
    at = 0
    while at < len(message):
        tag, at = _varint(message, at)
        number, wire = tag >> 3, tag & 7
        value, at = (int.from_bytes(message[at : at + 8], "little"), at + 8) if wire == _FIXED64 else _varint(message, at)
        if wire == _BYTES:
            yield number, message[at : at + value]
            at += value
        elif wire in {_VARINT, _FIXED64}:
            yield number, value
        else:
            raise ValueError(f"wire type {wire}")


def _varint(message: bytes, at: int) -> tuple[int, int]:
    """Return a number of seven bits a byte, the lowest first, and where the next field begins."""
    value = shift = 0
    while True:
        value |= (message[at] & 0x7F) << shift
        if message[at] < 0x80:
            return value, at + 1
        at, shift = at + 1, shift + 7
