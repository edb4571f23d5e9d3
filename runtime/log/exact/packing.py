"""Packs the many columns of an entity into a few wide ones, and takes them apart again.

A tick has some 200 columns, most of one value.  Each would cost the writer 20 us a batch and the file half a kilobyte, whatever
it holds; so all values of a kind share a column, in the order of their columns at each tick, and `counts` tells how many each
has.  Which columns these are, and in which order, is logged once, as a layout, under the checksum of their names.
"""

from __future__ import annotations

import operator
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby, pairwise
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import rerun as rr
from numpy.typing import NDArray

from runtime.log.exact.checksum import Cells
from runtime.log.exact.columns import ArrowColumn, Column, Kind

LAYOUTS = "/replay/layouts"
KINDS = {"ints": Kind.INT, "floats": Kind.FLOAT, "flags": Kind.FLAG, "texts": Kind.TEXT}
COUNTS, LAYOUT = "counts", "layout"
COMPONENTS = (*KINDS, COUNTS, LAYOUT)
I64 = NDArray[np.int64]


class Share(NamedTuple):
    """A column over some ticks: all values, and where those of each tick end."""

    values: Sequence[Any] | NDArray[Any]
    ends: I64

    def at(self, row: int) -> Any:
        """Return the values of a tick."""
        return self.values[self.ends[row - 1] if row else 0 : self.ends[row]]


_NOTHING = Share([], np.zeros(0, np.int64))


class Named(NamedTuple):
    """A column and the entity that it belongs to."""

    entity: str
    column: Column


class Layout(NamedTuple):
    """The columns of an entity, kind by kind."""

    key: int
    columns: tuple[str, ...]  # "kind entity name"

    @property
    def entity(self) -> str:
        """Where it is logged."""
        return f"{LAYOUTS}/{self.key:08x}"

    def as_components(self) -> rr.AnyValues:
        """Return what is logged there."""
        return rr.AnyValues(columns=list(self.columns))


def layout_of(columns: tuple[str, ...]) -> Layout:
    """Return the layout of columns, each "kind entity name".

    >>> layout_of(("ints /a x", "floats /a y")).entity.startswith(LAYOUTS)
    True
    """
    return Layout(zlib.crc32("\n".join(columns).encode()), columns)


@dataclass(frozen=True, slots=True, eq=False)
class Packed:
    """The columns of an entity over a batch of ticks."""

    layout: Layout
    counts: I64  # (ticks, columns)
    values: Mapping[str, Sequence[str] | NDArray[Any]]  # of all ticks, by kind
    ends: Mapping[str, I64]  # (ticks,): of each tick's values among these

    def cells(self) -> list[Cells]:
        """Return all of it for a checksum."""
        ticks, width = self.counts.shape
        each = np.arange(1, ticks + 1)
        return [
            *(Cells(kind, values, self.ends[kind]) for kind, values in self.values.items()),
            Cells(COUNTS, self._lengths(), width * each),
            Cells(LAYOUT, np.full(ticks, self.layout.key), each),
        ]

    def finished(self) -> list[ArrowColumn]:
        """Return the wide columns; those without any value are left out."""
        ticks, width = self.counts.shape
        each = np.arange(1, ticks + 1)
        arrays = [(kind, pa.array(values, KINDS[kind].value), self.ends[kind]) for kind, values in self.values.items()]
        arrays.append((COUNTS, pa.array(self._lengths()), width * each))
        arrays.append((LAYOUT, pa.array(np.full(ticks, self.layout.key)), each))
        return [_listed(name, flat, ends) for name, flat, ends in arrays if len(flat)]

    def _lengths(self) -> NDArray[np.uint32]:
        return self.counts.reshape(-1).astype(np.uint32)


def pack(named: Sequence[Named]) -> Packed:
    """Pack columns of the same ticks.

    Raises:
        pyarrow.ArrowInvalid, pyarrow.ArrowTypeError, TypeError: a value is not what its column holds.
    """
    groups = {kind: [n for n in named if n.column.kind is KINDS[kind]] for kind in KINDS}
    counts: list[I64] = []
    values: dict[str, list[str] | NDArray[Any]] = {}
    ends: dict[str, I64] = {}
    for kind, group in groups.items():
        bounds: I64 = np.array([[0, *n.column.ends] for n in group], np.int64)
        held = bounds[:, 1:] - bounds[:, :-1]  # (columns, ticks)
        order = transposed(held)
        together = _together(kind, [n.column for n in group])
        values[kind] = [together[i] for i in order.tolist()] if isinstance(together, list) else together[order]
        ends[kind] = held.sum(axis=0).cumsum()
        counts.append(held)
    names = tuple((kind, n.entity, n.column.name) for kind, group in groups.items() for n in group)
    return Packed(_layout(names), np.concatenate(counts).T, values, ends)


def share_of(column: pa.Array) -> Share:
    """Return a column of lists."""
    ends = np.cumsum(pc.fill_null(pc.list_value_length(column), 0).to_numpy(zero_copy_only=False), dtype=np.int64)
    flat = column.flatten()  # unlike `values` it respects a slice of the column
    if pa.types.is_primitive(flat.type) and flat.null_count == 0:
        return Share(flat.to_numpy(zero_copy_only=False), ends)
    return Share(flat.to_pylist(), ends)


def unpack(packed: Mapping[str, Share], layouts: Mapping[int, Layout]) -> dict[str, dict[str, Share]]:
    """Return the columns by entity and name; `packed` are wide columns of the same ticks by their names.

    Raises:
        ValueError: they do not fit each other, or their layout is none of these.
    """
    if not {COUNTS, LAYOUT} <= packed.keys():
        raise ValueError("it has no layout")
    keys = np.asarray(packed[LAYOUT].values, np.int64)
    begins = np.flatnonzero(np.diff(keys, prepend=keys[:1] - 1))  # nearly always one layout, but it may change
    runs = [
        _unpacked(_between(packed, begin, end), layouts, int(keys[begin]))
        for begin, end in pairwise([*begins.tolist(), len(keys)])
    ]
    if len(runs) == 1:
        return runs[0][0]
    entities = dict.fromkeys(entity for run, _ in runs for entity in run)
    return {entity: _chained(entity, runs) for entity in entities}


def _unpacked(packed: Mapping[str, Share], layouts: Mapping[int, Layout], key: int) -> tuple[dict[str, dict[str, Share]], int]:
    """Return the columns of ticks of one layout, and how many ticks that are."""
    if key not in layouts:
        raise ValueError(f"there is no layout {key:08x}")
    columns, ticks = [name.split(" ") for name in layouts[key].columns], len(packed[LAYOUT].values)
    counts = np.asarray(packed[COUNTS].values, np.int64)
    if len(counts) != ticks * len(columns):
        raise ValueError("the layout is of other columns")
    counts = counts.reshape(ticks, len(columns))
    found: dict[str, dict[str, Share]] = {}
    at = 0
    for kind, group in groupby(columns, key=operator.itemgetter(0)):
        names = [(entity, name) for _, entity, name in group]
        held = counts[:, at : at + len(names)]
        at += len(names)
        shares = _shares(packed.get(kind, _NOTHING), held)
        for (entity, name), share in zip(names, shares, strict=True):
            found.setdefault(entity, {})[name] = share
    return found, ticks


def _shares(wide: Share, counts: I64) -> list[Share]:
    """Return each column of a wide one; `counts` are of shape (ticks, columns)."""
    order, bounds = transposed(counts), np.concatenate(([0], np.cumsum(counts.sum(axis=0)))).tolist()
    if len(order) != len(wide.values):
        raise ValueError(f"there are {len(wide.values)} values, not {len(order)}")
    flat = [wide.values[i] for i in order.tolist()] if isinstance(wide.values, list) else np.asarray(wide.values)[order]
    ends = np.cumsum(counts, axis=0).T
    return [Share(flat[first:last], column) for (first, last), column in zip(pairwise(bounds), ends, strict=True)]


def _between(packed: Mapping[str, Share], begin: int, end: int) -> dict[str, Share]:
    """Return the ticks from `begin` to `end`."""
    parts = {}
    for name, (values, ends) in packed.items():
        first = int(ends[begin - 1]) if begin else 0
        parts[name] = Share(values[first : int(ends[end - 1])], ends[begin:end] - first)
    return parts


def _chained(entity: str, runs: Sequence[tuple[dict[str, dict[str, Share]], int]]) -> dict[str, Share]:
    """Return the columns of an entity over all runs, one after the other."""
    chained = {}
    for name in dict.fromkeys(name for run, _ in runs for name in run.get(entity, {})):
        parts = [run.get(entity, {}).get(name, Share([], np.zeros(ticks, np.int64))) for run, ticks in runs]
        ends = np.cumsum(np.concatenate([np.diff(part.ends, prepend=0) for part in parts]))
        some = [part.values for part in parts if len(part.values)]
        numbers = all(isinstance(values, np.ndarray) for values in some) and some
        chained[name] = Share(np.concatenate(some) if numbers else [value for values in some for value in values], ends)
    return chained


def transposed(counts: I64) -> I64:
    """Return where the values of a table's cells, stored row by row, lie when they are to be stored column by column.

    >>> transposed(np.array([[1, 2], [0, 1]])).tolist()
    [0, 1, 2, 3]
    >>> transposed(np.array([[1, 1], [1, 1]])).tolist()
    [0, 2, 1, 3]
    """
    starts = (np.cumsum(counts).reshape(counts.shape) - counts).T.reshape(-1)
    lengths = counts.T.reshape(-1)
    ends = np.cumsum(lengths)
    return np.repeat(starts - ends + lengths, lengths) + np.arange(lengths.sum())


def _together(kind: str, columns: Sequence[Column]) -> list[str] | NDArray[Any]:
    """Return all values, column after column."""
    values = [value for column in columns for value in column.values]
    whole = Column(kind, KINDS[kind], values)
    try:
        flat = whole.flat()
    except (pa.ArrowInvalid, pa.ArrowTypeError, TypeError):
        for column in columns:  # to name the one that it was
            column.flat()
        raise
    return values if kind == "texts" else np.asarray(flat.to_numpy(zero_copy_only=False))


@lru_cache(maxsize=64)
def _layout(names: tuple[tuple[str, str, str], ...]) -> Layout:
    return layout_of(tuple(" ".join(name) for name in names))


def _listed(name: str, flat: pa.Array, ends: I64) -> ArrowColumn:
    offsets = pa.array(np.concatenate(([0], ends)).astype(np.int32))
    return ArrowColumn(rr.ComponentDescriptor(name), pa.ListArray.from_arrays(offsets, flat))
