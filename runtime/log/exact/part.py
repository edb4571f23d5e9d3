"""The exact part of the log, under /replay: all that the loop consumed and decided, with a checksum a tick."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from typing import NamedTuple, get_type_hints

import numpy as np

from drivers.interface.sensed import Sensed
from runtime.cycle import Cycle
from runtime.log.exact import checksum, rvl
from runtime.log.exact.checksum import Cells, checksums
from runtime.log.exact.columns import ArrowColumn, Column, Kind
from runtime.log.exact.packing import Layout, Named, pack
from runtime.log.exact.schema import Schema


class Batch(NamedTuple):
    """Columns of one entity, one row for each of the ticks in `rows` (None: all of the batch)."""

    entity: str
    columns: list[ArrowColumn]
    rows: Sequence[int] | None = None


CHECK = "/replay/check"
CONSUMED = "/replay/sensed"  # packed columns
DECIDED = "/replay/decided"
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
        self._layouts: dict[int, Layout] = {}
        self._new_layouts: list[Layout] = []

    def put(self, cycle: Cycle, lost_before: int) -> None:
        """Add a tick, after `lost_before` ticks that could not be recorded."""
        for name, schema in self._consumed.items():
            schema.put(getattr(cycle.sensed, name))
        for name, schema in self._decided.items():
            schema.put(getattr(cycle, name))
        self._lost.append(lost_before)

    def batches(self) -> Iterator[Batch]:
        """Yield all columns of the ticks since the last call and start anew."""
        consumed, decided = pack(_named(self._consumed)), pack(_named(self._decided))
        for layout in (consumed.layout, decided.layout):
            if layout.key not in self._layouts:
                self._layouts[layout.key] = layout
                self._new_layouts.append(layout)
        images = [(s.entity, c) for s in self._consumed.values() for c in s.columns.values() if c.kind is Kind.IMAGE and c.values]
        cells = [*consumed.cells(), *(Cells(f"{entity} {c.name}", c.values, c.ends) for entity, c in images)]
        yield Batch(CONSUMED, consumed.finished())
        for entity, column in images:  # no row where there is none: an empty one would blank the viewer
            rows = np.flatnonzero(np.diff(column.ends, prepend=0)).tolist()
            yield Batch(entity, [column.finished(column.flat(), list(range(1, len(rows) + 1)))], rows)
        yield Batch(CHECK, [_single("crc32", checksums(cells, len(self._lost))), _single("lost_before", self._lost)])
        yield Batch(DECIDED, decided.finished())
        self._clear()

    def new_layouts(self) -> list[Layout]:
        """Return the layouts that were first used since the last call: a file needs them before the columns."""
        new, self._new_layouts = self._new_layouts, []
        return new

    def _clear(self) -> None:
        self._lost.clear()
        for schema in (*self._consumed.values(), *self._decided.values()):
            schema.clear()


def _named(schemas: Mapping[str, Schema]) -> list[Named]:
    """Return the columns that are packed: all but the images."""
    return [Named(s.entity, column) for s in schemas.values() for column in s.columns.values() if column.kind is not Kind.IMAGE]


def _single(name: str, values: Sequence[int]) -> ArrowColumn:
    column = Column(name, Kind.INT, list(values), list(range(1, len(values) + 1)))
    return column.finished(column.flat())
