"""Pieces of a log as columns again, and what of an earlier piece is still drawn at a later tick."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pyarrow as pa
import rerun as rr
from rerun.chunk import Chunk

from runtime.log.drawn.events import EVENTS
from runtime.log.exact.columns import IMAGE_COMPONENT, ArrowColumn

_NOT_CARRIED = (EVENTS, "/timing")  # what happened at a moment does not last


@dataclass(frozen=True, slots=True)
class Piece:
    """Some rows of one entity."""

    entity: str
    ticks: list[int]
    starts_ns: list[int]
    columns: list[ArrowColumn]


def piece_of(chunk: Chunk) -> Piece:
    """Return a chunk that is not static as columns that can be sent again."""
    batch = chunk.to_record_batch()
    times: dict[str, pa.Array] = {}
    columns: list[ArrowColumn] = []
    for field, column in zip(batch.schema, batch.columns, strict=True):
        match (field.metadata or {}).get(b"rerun:kind"):
            case b"index":
                times[field.name] = column
            case b"data":
                columns.append(ArrowColumn(_descriptor(field), column))
    return Piece(chunk.entity_path, times["tick"].to_pylist(), times["mono"].cast(pa.int64()).to_pylist(), columns)


class Carried:
    """The newest value before a tick of each component that is drawn: the viewer goes on showing it."""

    def __init__(self, first_tick: int) -> None:
        """Carry to the tick."""
        self._first_tick = first_tick
        self._newest: dict[tuple[str, str], tuple[int, ArrowColumn]] = {}

    def put(self, piece: Piece) -> None:
        """Take note of what a piece draws."""
        if piece.entity.startswith(_NOT_CARRIED):
            return
        for column in piece.columns:
            if not isinstance(column.descriptor, rr.ComponentDescriptor) or not _is_drawn(column.descriptor):
                continue
            key = (piece.entity, str(column.descriptor))
            for row, tick in enumerate(piece.ticks):
                if tick <= self._first_tick and tick >= self._newest.get(key, (-1,))[0] and column.array[row].is_valid:
                    self._newest[key] = (tick, ArrowColumn(column.descriptor, column.array.slice(row, 1)))

    def columns(self) -> Iterator[tuple[str, list[ArrowColumn]]]:
        """Yield per entity what is carried: all that has no value of its own at the tick."""
        entities: dict[str, list[ArrowColumn]] = {}
        for (entity, _), (tick, column) in sorted(self._newest.items(), key=lambda item: item[0]):
            if tick < self._first_tick:
                entities.setdefault(entity, []).append(column)
        yield from entities.items()


def _is_drawn(descriptor: rr.ComponentDescriptor) -> bool:
    return descriptor.archetype is not None and descriptor.component != IMAGE_COMPONENT.component


def _descriptor(field: pa.Field) -> rr.ComponentDescriptor:
    said = {key.decode(): value.decode() for key, value in field.metadata.items()}
    return rr.ComponentDescriptor(
        said["rerun:component"], archetype=said.get("rerun:archetype"), component_type=said.get("rerun:component_type")
    )
