"""Reads a log back: every value that was recorded, by entity, component and tick, bit for bit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from rerun.chunk import Chunk

from drivers.interface.errors import ConfigurationError
from runtime.log.drawn.events import EVENTS
from runtime.log.exact import rvl
from runtime.log.exact.columns import IMAGE_COMPONENT
from runtime.log.exact.packing import LAYOUTS, Layout, layout_of, share_of, unpack
from runtime.log.exact.part import CHECK, CONSUMED, DECIDED
from runtime.log.reading.opening import chunks, chunks_of_file

_NOT_CONTENT = ("/timing", "/run")
STATIC = -1  # stands for the tick of what holds for the whole run
_IMAGE = str(IMAGE_COMPONENT.component)
Cell = NDArray[Any] | list[Any]  # the values of one component at one tick
History = Mapping[int, Cell]  # by tick


@dataclass(frozen=True, slots=True)
class Log:
    """What a log holds: cells by entity, component and tick."""

    path: Path
    entities: Mapping[str, Mapping[str, History]]

    @property
    def ticks(self) -> list[int]:
        """Every recorded tick."""
        return sorted(self.history(CHECK, "crc32"))

    def history(self, entity: str, component: str) -> History:
        """Return the cells of a component by tick; none if it was never recorded."""
        return self.entities.get(entity, {}).get(component, {})

    def at(self, entity: str, tick: int) -> dict[str, Cell]:
        """Return the components of an entity at a tick; an image is decoded, under the name of its column."""
        found = {name: cells[tick] for name, cells in self.entities.get(entity, {}).items() if tick in cells}
        if _IMAGE in found:
            found["depth"] = [rvl.decode(np.asarray(found.pop(_IMAGE)[0]))]
        return found


def read(path: Path, content: str = "/**") -> Log:
    """Read a log, or all its files, or only the entities that match `content`; packed columns only with all of /replay.

    Raises:
        ConfigurationError: a file is missing, empty, cut, or not a log of ours.
    """
    return _gathered(path, chunks(path, content))


def read_file(file: Path, content: str) -> Log:
    """Read one file of a log.

    Raises:
        ConfigurationError: it is damaged.
    """
    return _gathered(file, chunks_of_file(file, content))


def _gathered(path: Path, pieces: Iterable[Chunk]) -> Log:
    entities: dict[str, dict[str, dict[int, Cell]]] = {}
    packed: list[pa.RecordBatch] = []
    layouts: dict[int, Layout] = {}
    for chunk in pieces:
        batch = chunk.to_record_batch()
        if chunk.entity_path in {CONSUMED, DECIDED}:
            packed.append(batch)
            continue
        if chunk.entity_path.startswith(LAYOUTS):
            layout = layout_of(tuple(batch.column("columns")[0].as_py()))
            layouts[layout.key] = layout
            continue
        times = _times(batch)
        for name, column in _columns(batch, b"data"):
            _hold(entities, chunk.entity_path, name, _cells(times, column))
    for batch in packed if layouts else ():
        for entity, name, cells in _unpacked(batch, layouts):
            _hold(entities, entity, name, cells)
    return Log(path, {entity: _ordered(entities[entity]) for entity in sorted(entities)})


def _hold(entities: dict[str, dict[str, dict[int, Cell]]], entity: str, name: str, cells: Iterable[tuple[int, Cell]]) -> None:
    held = entities.setdefault(entity, {}).setdefault(name, {})
    for tick, cell in cells:
        held[tick] = _joined(held[tick], cell) if tick in held and tick != STATIC else cell


def _times(batch: pa.RecordBatch) -> list[int]:
    return next((c.to_pylist() for name, c in _columns(batch, b"index") if name == "tick"), [STATIC] * batch.num_rows)


def _unpacked(batch: pa.RecordBatch, layouts: Mapping[int, Layout]) -> Iterator[tuple[str, str, Iterator[tuple[int, Cell]]]]:
    """Yield the columns that a packed chunk holds: the entity and name of each, and its cells.

    Raises:
        ConfigurationError: they do not fit each other.
    """
    times = _times(batch)
    wide = {name: share_of(column) for name, column in _columns(batch, b"data")}
    try:
        entities = unpack(wide, layouts)
    except ValueError as error:
        raise ConfigurationError(f"the log is damaged between the ticks {times[0]} and {times[-1]}: {error}") from error
    for entity, columns in entities.items():
        for name, share in columns.items():
            yield entity, name, ((tick, cell) for row, tick in enumerate(times) if len(cell := share.at(row)))


def ticks(path: Path) -> list[int]:
    """Return every tick that a log holds.

    Raises:
        ConfigurationError: see `read`.
    """
    return read(path, CHECK).ticks


def texts(path: Path) -> str:
    """Return what a log says in words, a line each: faults, responses, the operator's actions.

    Raises:
        ConfigurationError: see `read`.
    """
    history = read(path, EVENTS).history(EVENTS, "TextLog:text")
    return "\n".join(text for cell in history.values() for text in cell)


def same_content(first: Path, second: Path) -> str:
    """Return the first difference between two logs as a sentence; empty when there is none.

    Compared is what was recorded and drawn of the ticks, bit by bit; not how long it took, nor where the logs come from.
    """
    one, other = read(first), read(second)
    found = [
        _difference(entity, component, one.history(entity, component), other.history(entity, component))
        for entity, component in sorted(_addresses(one) | _addresses(other))
        if not entity.startswith(_NOT_CONTENT)
    ]
    return min((difference for difference in found if difference is not None), default=(0, ""))[1]


def _ordered(components: Mapping[str, History]) -> dict[str, History]:
    return {name: dict(sorted(components[name].items())) for name in sorted(components)}


def _columns(batch: pa.RecordBatch, kind: bytes) -> Iterator[tuple[str, pa.Array]]:
    for field, column in zip(batch.schema, batch.columns, strict=True):
        if (field.metadata or {}).get(b"rerun:kind") == kind:
            yield field.name, column


def _cells(ticks: list[int], column: pa.Array) -> Iterator[tuple[int, Cell]]:
    """Yield each row's values; an empty list is no value."""
    offsets = column.offsets.to_numpy()
    flat = column.flatten()  # unlike `values` it respects a slice of the column
    numbers = pa.types.is_primitive(flat.type) and flat.null_count == 0
    values = flat.to_numpy(zero_copy_only=False) if numbers else None
    for row, tick in enumerate(ticks):
        start, end = int(offsets[row] - offsets[0]), int(offsets[row + 1] - offsets[0])
        if end > start:
            yield tick, values[start:end] if values is not None else _listed(flat[start:end])


def _joined(first: Cell, second: Cell) -> Cell:
    """Return the values of two rows of the same tick, as texts have them."""
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        return np.concatenate((first, second))
    return [*first, *second]


def _listed(flat: pa.Array) -> list[Any]:
    """Return texts as they are, and bytes or structures in a form that compares bit by bit."""
    if pa.types.is_list(flat.type) and pa.types.is_uint8(flat.type.value_type):
        return [item.values.to_numpy() for item in flat]
    return list(flat.to_pylist())


def _addresses(log: Log) -> set[tuple[str, str]]:
    return {(entity, component) for entity, components in log.entities.items() for component in components}


def _difference(entity: str, component: str, one: History, other: History) -> tuple[int, str] | None:
    for tick in sorted({*one, *other}):
        a, b = one.get(tick), other.get(tick)
        if a is None or b is None or not _same(a, b):
            where = "in what holds for the whole run" if tick == STATIC else f"at tick {tick}"
            return tick, f"{entity} {component} differs {where}: {_shown(a)} and {_shown(b)}"
    return None


def _same(a: Cell, b: Cell) -> bool:
    """Compare bit by bit: NaN equals itself, and 0.0 is not -0.0."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.dtype == b.dtype and a.tobytes() == b.tobytes()
    return len(a) == len(b) and all(
        _same(x, y) if isinstance(x, np.ndarray) and isinstance(y, np.ndarray) else x == y for x, y in zip(a, b, strict=True)
    )


def _shown(cell: Cell | None) -> str:
    if cell is None:
        return "nothing"
    text = np.array2string(cell, threshold=12) if isinstance(cell, np.ndarray) else str(cell)
    return text if len(text) < 120 else text[:117] + "..."
