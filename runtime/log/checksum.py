"""A CRC-32 a tick over all that replay consumes: Rerun's files have no checksum of their own over the values."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Cells(NamedTuple):
    """One column over all ticks of a batch: texts, images or numbers; `ends` tells each tick's share."""

    name: str
    values: Sequence[str] | Sequence[NDArray[np.uint16]] | NDArray[Any]
    ends: Sequence[int]


def checksums(columns: Sequence[Cells], ticks: int) -> list[int]:
    """Return the CRC-32 of each tick over the name and the bytes of every cell that is not empty, in the names' order.

    >>> some = Cells("vx", np.array([1.0, 2.0]), [1, 1, 2])
    >>> checksums([some], 3) == checksums([Cells("none", np.array([]), [0, 0, 0]), some], 3)
    True
    """
    rows: list[list[Any]] = [[] for _ in range(ticks)]
    for name, values, ends in sorted(columns, key=lambda column: column.name):
        label = name.encode()
        for row, (start, end) in zip(rows, pairwise([0, *ends]), strict=True):
            if end > start:
                row.extend((label, *_bytes(values[start:end])))
    return [zlib.crc32(b"".join(row)) for row in rows]


def _bytes(values: Any) -> Sequence[Any]:
    if isinstance(values, np.ndarray):
        return (values.data,)
    return tuple(value.encode() if isinstance(value, str) else np.ascontiguousarray(value).data for value in values)
