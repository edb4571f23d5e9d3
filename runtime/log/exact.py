"""The exact part of the log, under /replay: all that the loop consumed and decided, with a checksum a tick."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields
from typing import Any, NamedTuple, get_type_hints

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from drivers.interface.sensed import Sensed
from runtime.cycle import Cycle
from runtime.log import checksum, rvl
from runtime.log.checksum import Cells, checksums
from runtime.log.columns import ArrowColumn, Column, Kind
from runtime.log.schema import Schema


class Batch(NamedTuple):
    """Columns of one entity, one row for each of the ticks in `rows` (None: all of the batch)."""

    entity: str
    columns: list[ArrowColumn]
    rows: Sequence[int] | None = None


CHECK = "/replay/check"
_CONSUMED = get_type_hints(Sensed)
_DECIDED = {name: hint for name, hint in get_type_hints(Cycle).items() if name not in {"sensed", "stage_ns"}}


def warm_up() -> None:
    """Compile what the columns are coded and summed up with, so that the first batch does not have to wait for it."""
    rvl.warm_up()
    checksum.warm_up()


def consumed_schemas(images: bool = True) -> dict[str, Schema]:
    """Return the columns of what the loop consumed, by the fields of `Sensed`; what is only looked at is not among them."""
    return {f.name: Schema(f"/replay/sensed/{f.name}", _CONSUMED[f.name], images) for f in fields(Sensed) if f.compare}


def decided_schemas() -> dict[str, Schema]:
    """Return the columns of what the loop decided, by the fields of `Cycle`."""
    return {name: Schema(f"/replay/{name}", hint) for name, hint in _DECIDED.items()}


class ExactPart:
    """Takes cycles apart into columns."""

    def __init__(self, images: bool) -> None:
        """Record depth images, or leave them out (the log can then not be replayed)."""
        self._consumed = consumed_schemas(images)
        self._decided = decided_schemas()
        self._lost: list[int] = []

    def put(self, cycle: Cycle, lost_before: int) -> None:
        """Add a tick, after `lost_before` ticks that could not be recorded."""
        for name, schema in self._consumed.items():
            schema.put(getattr(cycle.sensed, name))
        for name, schema in self._decided.items():
            schema.put(getattr(cycle, name))
        self._lost.append(lost_before)

    def batches(self) -> Iterator[Batch]:
        """Yield all columns of the ticks since the last call and start anew."""
        cells: list[Cells] = []
        for schema in self._consumed.values():
            arrays = [(column, column.flat()) for column in schema.columns.values() if column.values]
            cells += [Cells(f"{schema.entity} {c.name}", _comparable(c, flat), c.ends) for c, flat in arrays]
            yield Batch(schema.entity, [c.finished(flat) for c, flat in arrays if c.kind is not Kind.IMAGE])
            for column, flat in arrays:
                if column.kind is Kind.IMAGE:  # no row where there is none: an empty one would blank the viewer
                    rows = np.flatnonzero(np.diff(column.ends, prepend=0)).tolist()
                    yield Batch(schema.entity, [column.finished(flat, list(range(1, len(rows) + 1)))], rows)
        yield Batch(CHECK, [_single("crc32", checksums(cells, len(self._lost))), _single("lost_before", self._lost)])
        for schema in self._decided.values():
            yield Batch(schema.entity, [c.finished(c.flat()) for c in schema.columns.values() if c.values])
        self._clear()

    def _clear(self) -> None:
        self._lost.clear()
        for schema in (*self._consumed.values(), *self._decided.values()):
            schema.clear()


def _comparable(column: Column, flat: pa.Array) -> Sequence[Any] | NDArray[Any]:
    """Return the values as the checksum reads them: what the loop used, before any encoding."""
    if column.kind in {Kind.TEXT, Kind.IMAGE}:
        return column.values
    return np.asarray(flat.to_numpy(zero_copy_only=False))


def _single(name: str, values: Sequence[int]) -> ArrowColumn:
    column = Column(name, Kind.INT, list(values), list(range(1, len(values) + 1)))
    return column.finished(column.flat())
