"""A CRC-32 a tick over all that replay consumes: Rerun's files have no checksum of their own over the values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]
U32 = NDArray[np.uint32]


class Cells(NamedTuple):
    """One column over all ticks of a batch: texts, images or numbers; `ends` tells each tick's share."""

    name: str
    values: Sequence[str] | Sequence[NDArray[np.uint16]] | NDArray[Any]
    ends: Sequence[int] | I64


def checksums(columns: Sequence[Cells], ticks: int) -> list[int]:
    """Return the CRC-32 of each tick over the name and the bytes of every cell that is not empty, in the names' order.

    >>> some = Cells("vx", np.array([1.0, 2.0]), [1, 1, 2])
    >>> checksums([some], 3) == checksums([Cells("none", np.array([]), [0, 0, 0]), some], 3)
    True
    """
    pieces: list[U8] = [np.zeros(0, np.uint8)]
    bounds = np.zeros((len(columns), ticks + 2), np.int64)  # where the name begins, and each tick's share, and the last one ends
    at = 0
    for row, (name, values, ends) in enumerate(sorted(columns, key=lambda column: column.name)):
        label, (flat, shares) = np.frombuffer(name.encode(), np.uint8), _bytes(values, np.asarray(ends, np.int64))
        pieces += (label, flat)
        bounds[row, 0], bounds[row, 1] = at, at + label.size
        bounds[row, 2:] = at + label.size + shares
        at += label.size + flat.size
    crcs: list[int] = _crcs(np.concatenate(pieces), bounds, _TABLES).tolist()
    return crcs


def warm_up() -> None:
    """Compile, so that the first batch does not have to wait for it."""
    checksums([Cells("", np.zeros(1), [1])], 1)


def _bytes(values: Any, ends: I64) -> tuple[U8, I64]:
    """Return all values as bytes, and where each tick's share of them ends."""
    if isinstance(values, np.ndarray):
        return np.ascontiguousarray(values).view(np.uint8), ends * values.itemsize
    each = [value.encode() if isinstance(value, str) else np.ascontiguousarray(value).data.cast("B") for value in values]
    sizes = np.cumsum([0, *map(len, each)])
    return np.frombuffer(b"".join(each), np.uint8), sizes[ends]


def _tables() -> U32:
    """Return the tables of the CRC-32 of zlib for eight bytes at a time, shape (8, 256).

    Source: M. E. Kounavis, F. L. Berry, "Novel Table Lookup-Based Algorithms for High-Performance CRC Generation", IEEE
    Transactions on Computers 57(11), 2008.
    """
    tables = np.zeros((8, 256), np.uint32)
    tables[0] = np.arange(256)
    for _ in range(8):
        tables[0] = (tables[0] >> 1) ^ np.where(tables[0] & 1, np.uint32(0xEDB88320), np.uint32(0))
    for k in range(1, 8):
        tables[k] = (tables[k - 1] >> 8) ^ tables[0, tables[k - 1] & 255]
    return tables


_TABLES = _tables()


@kernel()
def _crcs(data: U8, bounds: I64, tables: U32) -> U32:
    columns, ticks = bounds.shape[0], bounds.shape[1] - 2
    crcs = np.empty(ticks, np.uint32)
    for tick in range(ticks):
        crc = np.uint32(0xFFFFFFFF)
        for column in range(columns):
            start, end = bounds[column, tick + 1], bounds[column, tick + 2]
            if end > start:
                crc = _crc(crc, data, bounds[column, 0], bounds[column, 1], tables)
                crc = _crc(crc, data, start, end, tables)
        crcs[tick] = ~crc
    return crcs


@kernel()
def _crc(crc: np.uint32, data: U8, start: int, end: int, tables: U32) -> np.uint32:
    """Go on with a CRC over the bytes from `start` to `end`."""
    low, at = np.uint32(255), start
    while end - at >= 8:
        crc ^= np.uint32(data[at]) | np.uint32(data[at + 1]) << np.uint32(8)
        crc ^= np.uint32(data[at + 2]) << np.uint32(16) | np.uint32(data[at + 3]) << np.uint32(24)
        crc = (
            tables[7, crc & low]
            ^ tables[6, (crc >> np.uint32(8)) & low]
            ^ tables[5, (crc >> np.uint32(16)) & low]
            ^ tables[4, crc >> np.uint32(24)]
            ^ tables[3, data[at + 4]]
            ^ tables[2, data[at + 5]]
            ^ tables[1, data[at + 6]]
            ^ tables[0, data[at + 7]]
        )
        at += 8
    while at < end:
        crc = tables[0, (crc ^ np.uint32(data[at])) & low] ^ (crc >> np.uint32(8))
        at += 1
    return crc
