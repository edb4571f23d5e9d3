"""Reads what replay needs of a log tick by tick, without holding all of it; images are decoded ahead in a thread of their own."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from drivers.interface.errors import ConfigurationError
from drivers.interface.sensed import Sensed
from runtime.faults import FaultReport
from runtime.keyframes import KeyFrame
from runtime.log import rvl
from runtime.log.checksum import Cells, checksums
from runtime.log.columns import IMAGE_COMPONENT, Column
from runtime.log.exact import CHECK, consumed_schemas, decided_schemas
from runtime.log.keyframes import KEY_FRAME, key_frame_of
from runtime.log.opening import chunks
from runtime.log.schema import Schema

AHEAD = 100  # ticks that are read before the first of them is given out
_IMAGE = str(IMAGE_COMPONENT.component)
_IMAGE_COLUMN = "depth"


@dataclass(slots=True, eq=False)
class _Part:
    """One column of one chunk."""

    values: Sequence[Any]
    array: NDArray[Any] | None  # the same, of numbers
    offsets: list[int]


class _Piece:
    """The columns of one chunk; each is taken out of it when it is first asked for, as many never are."""

    def __init__(self, columns: Mapping[str, pa.Array], parts: dict[str, _Part]) -> None:
        self._columns, self._parts = columns, parts

    def __iter__(self) -> Iterator[tuple[str, _Part]]:
        for name, column in self._columns.items():
            if name not in self._parts:
                self._parts[name] = _part(column)
        return iter(self._parts.items())


class Row:
    """What a log holds of one tick."""

    def __init__(self, tick: int) -> None:
        """Start with nothing."""
        self.tick = tick
        self._pieces: dict[str, list[tuple[_Piece, int]]] = {}

    def add(self, entity: str, piece: _Piece, row: int) -> None:
        """Add a row of a piece."""
        self._pieces.setdefault(entity, []).append((piece, row))

    def cells(self, entity: str) -> dict[str, Sequence[Any]]:
        """Return the values of an entity by the names of their columns; those without any are left out."""
        return {
            name: values for piece, row in self._pieces.get(entity, ()) for name, part in piece if (values := _slice(part, row))
        }

    @property
    def sensed(self) -> Sensed:
        """What the loop consumed.

        Raises:
            ConfigurationError: the log does not hold all of it.
        """
        try:
            return Sensed(**{name: schema.take(self.cells(schema.entity)) for name, schema in _consumed().items()})
        except ValueError as error:
            raise ConfigurationError(f"tick {self.tick} of the log cannot be replayed: {error}") from error

    @property
    def has_key_frame(self) -> bool:
        """Whether what the tick was begun with was recorded."""
        return KEY_FRAME in self._pieces

    @property
    def skipped(self) -> int:
        """How many grid times passed unused just before this tick."""
        return int(self.cells(_consumed()["tick"].entity)["skipped"][0])

    @property
    def key_frame(self) -> KeyFrame | None:
        """What the tick was begun with, where that was recorded.

        Raises:
            ConfigurationError: it is damaged.
        """
        return key_frame_of(self.cells(KEY_FRAME)) if self.has_key_frame else None

    def decided(self, name: str) -> Any:
        """Return what the loop decided, by the name of the field of `Cycle`; of grids, only their checksums.

        Raises:
            ConfigurationError: the log does not hold all of it.
        """
        schema = _decided()[name]
        try:
            return schema.take(self.cells(schema.entity))
        except ValueError as error:
            raise ConfigurationError(f"tick {self.tick} of the log cannot be compared: {error}") from error

    @property
    def given(self) -> tuple[FaultReport, ...]:
        """The faults that nothing sensed leads to."""
        verdict = _decided()["verdict"].entity
        if self.cells(verdict).get("given.count") == [0]:  # as nearly always: the rest need not be put together
            return ()
        given: tuple[FaultReport, ...] = self.decided("verdict").given
        return given

    @property
    def lost_before(self) -> int:
        """How many ticks before this one could not be recorded."""
        return int(self.cells(CHECK)["lost_before"][0])

    @property
    def is_sound(self) -> bool:
        """Whether the checksum fits what the log holds."""
        found: list[Cells] = []
        for schema in _consumed().values():
            for piece, row in self._pieces.get(schema.entity, ()):
                for name, part in piece:
                    start, end = part.offsets[row], part.offsets[row + 1]
                    if end > start:
                        values = _slice(part, row) if part.array is None else part.array[start:end]
                        found.append(Cells(f"{schema.entity} {name}", values, [end - start]))
        return bool(checksums(found, 1)[0] == self.cells(CHECK)["crc32"][0])


def rows(path: Path) -> Iterator[Row]:
    """Yield the complete ticks of a log, in order.

    Raises:
        ConfigurationError: the file is missing, empty, cut, or not a log of ours, or its ticks are out of order.
    """
    ready: deque[Row] = deque()
    with ThreadPoolExecutor(1, "depth") as decoding:
        gathering = _Gathering(decoding)
        for chunk in chunks(path, "/replay/**"):
            gathering.add(chunk.entity_path, chunk.to_record_batch())
            ready.extend(gathering.complete())
            while len(ready) > AHEAD:
                yield ready.popleft()
        yield from ready


class _Gathering:
    """Brings the columns of a tick together, as they come in any order of entities."""

    def __init__(self, decoding: ThreadPoolExecutor) -> None:
        self._decoding = decoding
        self._open: dict[int, Row] = {}
        self._reached = dict.fromkeys((CHECK, *_columns()), -1)  # the last tick of each entity that has one every tick
        self._given = -1

    def add(self, entity: str, batch: pa.RecordBatch) -> None:
        """Add a chunk."""
        known, times, found = _columns().get(entity), None, {}
        for field, column in zip(batch.schema, batch.columns, strict=True):
            kind = (field.metadata or {}).get(b"rerun:kind")
            if kind == b"index" and field.name == "tick":
                times = column
            elif kind == b"data" and _is_ours(entity, field.name, known):
                found[field.name] = column
        if times is None or not found:
            return
        image = found.pop(_IMAGE, None)
        piece = _Piece(found, {} if image is None else {_IMAGE_COLUMN: self._images(image)})
        ticks: list[int] = times.to_pylist()
        for row, tick in enumerate(ticks):
            self._row(tick).add(entity, piece, row)
        if entity in self._reached and found:
            self._reached[entity] = max(self._reached[entity], *ticks)

    def complete(self) -> Iterator[Row]:
        """Yield the ticks of which every entity has come, in order."""
        reached = min(self._reached.values())
        if reached <= self._given:
            return
        self._given = reached
        for tick in sorted(tick for tick in self._open if tick <= reached):
            yield self._open.pop(tick)

    def _row(self, tick: int) -> Row:
        if tick <= self._given:
            raise ConfigurationError(f"the log is out of order at tick {tick}; `trundle log repair` puts it right")
        if tick not in self._open:
            self._open[tick] = Row(tick)
        return self._open[tick]

    def _images(self, column: pa.Array) -> _Part:
        """Return the images, in the making."""
        codes = column.flatten()
        return _Part([self._decoding.submit(rvl.decode, code.values.to_numpy()) for code in codes], None, _offsets(column))


def _part(column: pa.Array) -> _Part:
    offsets, flat = _offsets(column), column.flatten()  # unlike `values` it respects a slice of the column
    if pa.types.is_list(flat.type):
        return _Part([item.values.to_numpy() for item in flat], None, offsets)
    if pa.types.is_primitive(flat.type) and flat.null_count == 0:
        array = flat.to_numpy(zero_copy_only=False)
        return _Part(array.tolist(), np.asarray(array), offsets)
    return _Part(flat.to_pylist(), None, offsets)


def _offsets(column: pa.Array) -> list[int]:
    offsets = column.offsets.to_numpy()
    shifted: list[int] = (offsets - offsets[0]).tolist()
    return shifted


def _slice(part: _Part, row: int) -> Sequence[Any]:
    values = part.values[part.offsets[row] : part.offsets[row + 1]]
    return [value.result() if isinstance(value, Future) else value for value in values] if part.array is None else values


def _is_ours(entity: str, component: str, known: Mapping[str, Column] | None) -> bool:
    """Tell values that replay needs from what is only drawn."""
    return ":" not in component or component == _IMAGE if known is not None else entity in {CHECK, KEY_FRAME}


@cache
def _consumed() -> dict[str, Schema]:
    return consumed_schemas()


@cache
def _decided() -> dict[str, Schema]:
    return decided_schemas()


@cache
def _columns() -> dict[str, dict[str, Column]]:
    return {schema.entity: schema.columns for schema in (*_consumed().values(), *_decided().values())}
