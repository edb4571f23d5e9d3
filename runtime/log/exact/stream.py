"""Reads what replay needs of a log block by block, without holding all of it; checked ahead in a thread of its own."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pyarrow as pa

from drivers.interface.errors import ConfigurationError
from runtime.log.exact.block import IMAGE, Block, Piece, Row
from runtime.log.exact.keyframes import KEY_FRAME
from runtime.log.exact.packing import LAYOUTS, Layout, layout_of
from runtime.log.exact.part import CHECK, CONSUMED, DECIDED
from runtime.log.reading.opening import chunks

AHEAD = 100  # ticks that are read before the first of them is given out
_ALWAYS = (CHECK, CONSUMED, DECIDED)


def rows(path: Path) -> Iterator[Row]:
    """Yield the complete ticks of a log, in order.

    Raises:
        ConfigurationError: the file is missing, empty, cut, or not a log of ours, or its ticks are out of order.
    """
    ready: deque[Block] = deque()
    with ThreadPoolExecutor(1, "depth") as ahead:
        gathering = _Gathering()
        for chunk in chunks(path, "/replay/**"):
            gathering.add(chunk.entity_path, chunk.to_record_batch())
            if (block := gathering.complete(ahead)) is not None:
                ready.append(block)
            while sum(len(block.ticks) for block in ready) > AHEAD:
                yield from ready.popleft()
        while ready:
            yield from ready.popleft()


class _Gathering:
    """Brings the columns of the same ticks together, as they come in any order of entities."""

    def __init__(self) -> None:
        self._pieces: dict[tuple[str, bool], list[Piece]] = {}  # by entity; images are apart, as not all ticks have one
        self._reached = dict.fromkeys(_ALWAYS, -1)  # the last tick of each entity that has one every tick
        self._layouts: dict[int, Layout] = {}
        self._given = -1

    def add(self, entity: str, batch: pa.RecordBatch) -> None:
        """Add a chunk."""
        if entity.startswith(LAYOUTS):
            layout = layout_of(tuple(batch.column("columns")[0].as_py()))
            self._layouts[layout.key] = layout
            return
        piece, images = _pieces(entity, batch)
        for some in (piece, images):
            if not some.columns or not some.ticks.size:
                continue
            if some.ticks.min() <= self._given:
                raise ConfigurationError(
                    f"the log is out of order at tick {some.ticks.min()}; `trundle log repair` puts it right"
                )
            self._pieces.setdefault((entity, some is images), []).append(some)
        if entity in self._reached and piece.columns and piece.ticks.size:
            self._reached[entity] = max(self._reached[entity], int(piece.ticks.max()))

    def complete(self, ahead: Executor) -> Block | None:
        """Return the ticks of which every entity has come; None: there are none."""
        reached = min(self._reached.values())
        if reached <= self._given:
            return None
        self._given = reached
        taken = {key: self._up_to(reached, key) for key in list(self._pieces)}
        return Block(
            {entity: piece for (entity, images), piece in taken.items() if not images},
            {entity: piece for (entity, images), piece in taken.items() if images},
            self._layouts,
            ahead,
        )

    def _up_to(self, reached: int, key: tuple[str, bool]) -> Piece:
        """Take out the rows of the ticks up to the one reached."""
        pieces = self._pieces.pop(key)
        whole = pieces[0] if len(pieces) == 1 else Piece.joined(pieces)
        later = whole.ticks > reached
        if not later.any():
            return whole
        self._pieces[key] = [whole.where(later)]
        return whole.where(~later)


def _pieces(entity: str, batch: pa.RecordBatch) -> tuple[Piece, Piece]:
    """Return the columns of a chunk that replay needs, and of these the images."""
    ticks = np.zeros(0, np.int64)
    columns: dict[str, pa.Array] = {}
    images: dict[str, pa.Array] = {}
    for field, column in zip(batch.schema, batch.columns, strict=True):
        name, kind = field.name, (field.metadata or {}).get(b"rerun:kind")
        if kind == b"index" and name == "tick":
            ticks = column.to_numpy()
        elif kind == b"data" and name == IMAGE:
            images[name] = column
        elif kind == b"data" and entity in {*_ALWAYS, KEY_FRAME}:
            columns[name] = column
    return Piece(ticks, columns), Piece(ticks, images)
