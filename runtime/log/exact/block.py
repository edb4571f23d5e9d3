"""Some ticks of a log that stand together: their columns in one piece each, checked and taken together as a whole."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from drivers.interface.errors import ConfigurationError
from drivers.interface.samples import frozen_array
from drivers.interface.sensed import Sensed
from runtime.faults import FaultReport
from runtime.keyframes import KeyFrame
from runtime.log.exact import rvl
from runtime.log.exact.checksum import Cells, checksums
from runtime.log.exact.columns import IMAGE_COMPONENT
from runtime.log.exact.keyframes import KEY_FRAME, key_frame_of
from runtime.log.exact.packing import Layout, Share, unpack
from runtime.log.exact.part import CHECK, CONSUMED, DECIDED, consumed_schemas, decided_schemas
from runtime.log.exact.schema import Schema

IMAGE = str(IMAGE_COMPONENT.component)
_IMAGE_COLUMN = "depth"


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """Columns of an entity: lists of values by name, one a tick of its own."""

    ticks: NDArray[np.int64]
    columns: Mapping[str, pa.Array]

    @staticmethod
    def joined(pieces: Sequence[Piece]) -> Piece:
        """Return several as one; where a piece lacks a column, it is null."""
        whole = pa.concat_tables([pa.table(dict(piece.columns)) for piece in pieces], promote_options="default")
        columns = {name: whole.column(name).combine_chunks() for name in whole.column_names}
        return Piece(np.concatenate([piece.ticks for piece in pieces]), columns)

    def where(self, mask: NDArray[np.bool_]) -> Piece:
        """Return the ticks that the mask tells."""
        return Piece(self.ticks[mask], {name: column.filter(pa.array(mask)) for name, column in self.columns.items()})

    def fitted(self, ticks: NDArray[np.int64]) -> Piece:
        """Return it in order, and without what is of other ticks than these."""
        piece = self
        if (np.diff(piece.ticks) < 0).any():
            order = np.argsort(piece.ticks, kind="stable")
            piece = Piece(piece.ticks[order], {name: column.take(pa.array(order)) for name, column in piece.columns.items()})
        return piece if (among := np.isin(piece.ticks, ticks)).all() else piece.where(among)


@dataclass(frozen=True, slots=True, eq=False)
class Values:
    """One column over the ticks of a block."""

    values: Sequence[Any] | NDArray[Any]  # of all ticks; of numbers an array, read-only
    ends: NDArray[np.int64]  # of each tick's share

    def at(self, index: int) -> Sequence[Any] | NDArray[Any]:
        """Return a tick's share."""
        return self.values[self.ends[index - 1] if index else 0 : self.ends[index]]


@dataclass(frozen=True, slots=True)
class _Checked:
    images: Mapping[str, Values]  # by entity
    sound: Sequence[bool]


class Block:
    """Ticks in their order, and what the log holds of each."""

    def __init__(
        self, columns: Mapping[str, Piece], images: Mapping[str, Piece], layouts: Mapping[int, Layout], ahead: Executor
    ) -> None:
        """Take the columns of each entity, and its coded images; these are decoded and checksums compared in `ahead`."""
        self._layouts = layouts
        self._numbers = np.unique(columns[CHECK].ticks)
        self.ticks: list[int] = self._numbers.tolist()
        self._columns, self._images = columns, images
        self._values: dict[str, dict[str, Values]] = {}
        self._sensed: list[Sensed] | None = None
        self._checked: Future[_Checked] = ahead.submit(self._check)

    def __iter__(self) -> Iterator[Row]:
        """Yield every tick."""
        return (Row(self, index) for index in range(len(self.ticks)))

    def values(self, entity: str) -> dict[str, Values]:
        """Return the columns of an entity by name, without the images."""
        if entity not in self._values:
            if entity in _members():
                self._unpack(_members()[entity])
            else:
                self._values[entity] = self._fitted(self._columns[entity]) if entity in self._columns else {}
        return self._values[entity]

    def _unpack(self, entity: str) -> None:
        """Take the columns out of the packed ones; those that do not fit are none."""
        packed = {name: Share(column.values, column.ends) for name, column in self.values(entity).items()}
        try:
            entities = unpack(packed, self._layouts)
        except ValueError:
            entities = {}
        for member in (member for member, whole in _members().items() if whole == entity):
            shares = entities.get(member, {})
            self._values[member] = {name: Values(_frozen(share.values), share.ends) for name, share in shares.items()}

    def cells(self, entity: str, index: int) -> dict[str, Any]:
        """Return a tick's values of an entity by the names of their columns; those without any are left out."""
        return {name: share for name, column in self._with_images(entity).items() if len(share := column.at(index))}

    def sound(self, index: int) -> bool:
        """Whether the checksum of a tick fits what the log holds."""
        return self._checked.result().sound[index]

    def sensed(self, index: int) -> Sensed:
        """Return what the loop consumed at a tick; of a block without damage all is taken together at once."""
        if not all(self._checked.result().sound):
            return Sensed(**{name: schema.take(self.cells(schema.entity, index)) for name, schema in consumed().items()})
        if self._sensed is None:
            self._sensed = list(map(Sensed, *(self._taken(schema) for schema in consumed().values())))
        return self._sensed[index]

    def _taken(self, schema: Schema) -> Sequence[Any]:
        taken = schema.take({name: c.values for name, c in self._with_images(schema.entity).items()}, len(self.ticks))
        return [taken] if len(self.ticks) == 1 else list(taken)

    def _with_images(self, entity: str) -> dict[str, Values]:
        images = {_IMAGE_COLUMN: self._checked.result().images[entity]} if entity in self._images else {}
        return self.values(entity) | images

    def _fitted(self, piece: Piece) -> dict[str, Values]:
        piece = piece.fitted(self._numbers)
        shares = np.searchsorted(piece.ticks, self._numbers, side="right")
        return {name: _values(column, shares) for name, column in piece.columns.items()}

    def _check(self) -> _Checked:
        cells = [Cells(name, column.values, column.ends) for name, column in self.values(CONSUMED).items()]
        images: dict[str, Values] = {}
        sound = np.ones(len(self.ticks), np.bool_)
        for entity in self._images:
            images[entity], whole = _decoded(self._fitted(self._images[entity])[IMAGE])
            sound &= whole
            cells.append(Cells(f"{entity} {_IMAGE_COLUMN}", images[entity].values, images[entity].ends))
        crc = self.values(CHECK).get("crc32")
        said = [list(crc.at(index)) if crc is not None else [] for index in range(len(self.ticks))]
        sound &= [[own] == recorded for own, recorded in zip(checksums(cells, len(self.ticks)), said, strict=True)]
        return _Checked(images, sound.tolist())


class Row:
    """What a log holds of one tick."""

    def __init__(self, block: Block, index: int) -> None:
        """Take the tick's place in its block."""
        self.block, self.index = block, index
        self.tick = block.ticks[index]

    def cells(self, entity: str) -> dict[str, Any]:
        """Return the values of an entity by the names of their columns; those without any are left out."""
        return self.block.cells(entity, self.index)

    @property
    def sensed(self) -> Sensed:
        """What the loop consumed.

        Raises:
            ConfigurationError: the log does not hold all of it.
        """
        try:
            return self.block.sensed(self.index)
        except ValueError as error:
            raise ConfigurationError(f"tick {self.tick} of the log cannot be replayed: {error}") from error

    def consumed(self, name: str) -> Any:
        """Return one field of what the loop consumed; the others need not be there.

        Raises:
            ConfigurationError: the log does not hold all of it.
        """
        schema = consumed()[name]
        try:
            return schema.take(self.cells(schema.entity))
        except ValueError as error:
            raise ConfigurationError(f"tick {self.tick} of the log does not hold '{name}': {error}") from error

    @property
    def has_key_frame(self) -> bool:
        """Whether what the tick was begun with was recorded."""
        return any(len(column.at(self.index)) for column in self.block.values(KEY_FRAME).values())

    @property
    def skipped(self) -> int:
        """How many grid times passed unused just before this tick."""
        return self._number(consumed()["tick"].entity, "skipped")

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
        schema = decided()[name]
        try:
            return schema.take(self.cells(schema.entity))
        except ValueError as error:
            raise ConfigurationError(f"tick {self.tick} of the log cannot be compared: {error}") from error

    @property
    def budget_ns(self) -> int:
        """How long the planner was given."""
        return self._number(decided()["plan"].entity, "budget_ns")

    @property
    def given(self) -> tuple[FaultReport, ...]:
        """The faults that nothing sensed leads to."""
        counts = self.block.values(decided()["verdict"].entity).get("given.count")
        if counts is not None and list(counts.at(self.index)) == [0]:  # as nearly always: the rest need not be put together
            return ()
        given: tuple[FaultReport, ...] = self.decided("verdict").given
        return given

    @property
    def lost_before(self) -> int:
        """How many ticks before this one could not be recorded."""
        return self._number(CHECK, "lost_before")

    @property
    def is_sound(self) -> bool:
        """Whether the checksum fits what the log holds."""
        return self.block.sound(self.index)

    def _number(self, entity: str, name: str) -> int:
        """Return a whole number that every sound tick has; 0: it is missing, and the tick damaged."""
        column = self.block.values(entity).get(name)
        return sum(int(value) for value in column.at(self.index)) if column is not None else 0


@cache
def consumed() -> dict[str, Schema]:
    """Return the columns of what the loop consumed, by the fields of `Sensed`."""
    return consumed_schemas()


@cache
def decided() -> dict[str, Schema]:
    """Return the columns of what the loop decided, by the fields of `Cycle`."""
    return decided_schemas()


@cache
def _members() -> dict[str, str]:
    """Return by entity the one that it is packed in."""
    return {s.entity: CONSUMED for s in consumed().values()} | {s.entity: DECIDED for s in decided().values()}


def _frozen(values: Any) -> Any:
    return frozen_array(values) if isinstance(values, np.ndarray) else values


def _values(column: pa.Array, shares: NDArray[np.int64]) -> Values:
    """Return a column whose first `shares` lists are those up to each tick of the block.

    What only damage can bring into it becomes something else than was written, which the checksum tells.
    """
    ends = _ends(column)[shares]
    flat = column.flatten()  # unlike `values` it respects a slice of the column, and leaves out what is null
    if pa.types.is_primitive(flat.type):
        numbers = (flat.fill_null(0) if flat.null_count else flat).to_numpy(zero_copy_only=False)
        return Values(frozen_array(np.array(numbers)), ends)  # a copy: as aligned as those that kernels were compiled for
    if pa.types.is_string(flat.type):
        return Values(_texts(flat), ends)
    if pa.types.is_list(flat.type):
        return Values([np.zeros(0, np.uint8) if item.values is None else item.values.to_numpy() for item in flat], ends)
    return Values([], np.zeros_like(ends))


def _ends(column: pa.Array) -> NDArray[np.int64]:
    """Return where the lists end among all values, after a 0."""
    if column.null_count:
        return np.concatenate(([0], np.cumsum(pc.fill_null(pc.list_value_length(column), 0).to_numpy(), dtype=np.int64)))
    offsets: NDArray[np.int32] = column.offsets.to_numpy()
    ends: NDArray[np.int64] = (offsets - offsets[0]).astype(np.int64)
    return ends


def _texts(flat: pa.Array) -> list[str]:
    try:
        texts: list[str | None] = flat.to_pylist()
    except UnicodeDecodeError:
        texts = [raw and raw.decode(errors="replace") for raw in flat.cast(pa.binary()).to_pylist()]
    return [text or "" for text in texts]


def _decoded(codes: Values) -> tuple[Values, NDArray[np.bool_]]:
    """Return the images, and of which ticks all are whole."""
    images = rvl.decode_all(list(codes.values))
    whole = np.array([image is not None for image in images], np.int64)
    counts = np.concatenate(([0], np.cumsum(whole)))[codes.ends]
    intact = np.diff(counts, prepend=0) == np.diff(codes.ends, prepend=0)
    return Values([image for image in images if image is not None], counts), intact
