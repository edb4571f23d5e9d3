"""Key frames in the log, under /replay/keyframe: states of our own as columns, snapshots as compressed bytes."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

import pyarrow as pa
import rerun as rr

from drivers.interface.errors import ConfigurationError
from runtime.keyframes import KeyFrame, KeyState
from runtime.log.exact.columns import ArrowColumn, offsets_of
from runtime.log.exact.part import Batch
from runtime.log.exact.schema import Schema

KEY_FRAME = "/replay/keyframe"
SNAPSHOTS = ("estimator", "router", "planner", "shield")
_BYTES = pa.list_(pa.field("item", pa.uint8(), nullable=False))
_LEVEL = 1  # a snapshot is mostly grids: already the fastest level makes them some thirty times smaller


class KeyFramePart:
    """Takes key frames apart into columns."""

    def __init__(self) -> None:
        """Start with no key frame."""
        self._schema = Schema(KEY_FRAME, KeyState)
        self._frames: list[KeyFrame] = []
        self._rows: list[int] = []

    def put(self, frame: KeyFrame, row: int) -> None:
        """Add the key frame of the tick that is a row of the batch."""
        self._schema.put(frame.state)
        self._frames.append(frame)
        self._rows.append(row)

    def batches(self) -> Iterator[Batch]:
        """Yield the columns of the key frames since the last call, if there are any, and start anew."""
        if not self._frames:
            return
        states = [column.finished(column.flat()) for column in self._schema.columns.values() if column.values]
        yield Batch(KEY_FRAME, [*states, *(self._snapshots(name) for name in SNAPSHOTS)], list(self._rows))
        self._schema.clear()
        self._frames.clear()
        self._rows.clear()

    def _snapshots(self, name: str) -> ArrowColumn:
        packed = [list(zlib.compress(getattr(frame, name), _LEVEL)) for frame in self._frames]
        ends = list(range(1, len(packed) + 1))
        return ArrowColumn(rr.ComponentDescriptor(name), pa.ListArray.from_arrays(offsets_of(ends), pa.array(packed, _BYTES)))


def key_frame_of(cells: Mapping[str, Any]) -> KeyFrame:
    """Return the key frame that a tick's cells, by column name, were made of.

    Raises:
        ConfigurationError: they are damaged.
    """
    try:
        snapshots = {name: zlib.decompress(bytes(cells[name][0])) for name in SNAPSHOTS}
        return KeyFrame(_schema().take(dict(cells)), **snapshots)
    except (KeyError, ValueError, zlib.error) as error:
        raise ConfigurationError(f"a key frame of the log is damaged ({error})") from error


@cache
def _schema() -> Schema:
    return Schema(KEY_FRAME, KeyState)
