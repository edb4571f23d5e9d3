"""Columns of lists: each tick adds a list of values, a batch of ticks becomes one Arrow array per column."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr
from numpy.typing import NDArray

from runtime.log.exact import rvl

IMAGE_COMPONENT = rr.ComponentDescriptor(  # so that the viewer shows what replay consumes, stored once
    "EncodedDepthImage:blob", archetype="rerun.archetypes.EncodedDepthImage", component_type="rerun.components.Blob"
)


class Kind(enum.Enum):
    """What a column's values are."""

    INT = pa.int64()
    FLOAT = pa.float64()
    FLAG = pa.bool_()
    TEXT = pa.string()
    IMAGE = pa.list_(pa.field("item", pa.uint8(), nullable=False))  # a 16-bit image, RVL-coded


@dataclass(frozen=True, slots=True, eq=False)
class ArrowColumn:
    """A finished Arrow array as Rerun's `send_columns` takes it: of values, or of times."""

    descriptor: rr.ComponentDescriptor | str
    array: pa.Array

    def component_descriptor(self) -> rr.ComponentDescriptor | str:
        """Return what Rerun knows the component by."""
        return self.descriptor

    def timeline_name(self) -> rr.ComponentDescriptor | str:
        """Return the timeline's name."""
        return self.descriptor

    def as_arrow_array(self) -> pa.Array:
        """Return the values."""
        return self.array


@dataclass(slots=True, eq=False)
class Column:
    """The values of one leaf over the ticks of a batch."""

    name: str
    kind: Kind
    values: list[Any] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)  # of each tick's list among the values

    def flat(self) -> pa.Array:
        """Return the values of all ticks.

        Raises:
            pyarrow.ArrowInvalid, pyarrow.ArrowTypeError, TypeError: a value is not what the column holds.
        """
        if self.kind is Kind.INT:
            return pa.array(self._integers(), self.kind.value)
        if self.kind is Kind.IMAGE:
            return pa.array([rvl.encode(image) for image in self.values], self.kind.value)
        return pa.array(self.values, self.kind.value)

    def _integers(self) -> NDArray[np.int64]:
        integers = np.array(self.values) if self.values else np.zeros(0, np.int64)
        if integers.dtype != np.int64:  # Arrow would cut 1.5 to 1
            raise TypeError(f"{self.name} holds whole numbers, not {self.values}")
        return integers

    def finished(self, flat: pa.Array, ends: Sequence[int] | None = None) -> ArrowColumn:
        """Return one list of values per tick, or per row that ends where told."""
        descriptor = IMAGE_COMPONENT if self.kind is Kind.IMAGE else rr.ComponentDescriptor(self.name)
        return ArrowColumn(descriptor, pa.ListArray.from_arrays(offsets_of(self.ends if ends is None else ends), flat))


def offsets_of(ends: Sequence[int]) -> pa.Array:
    """Return where each list begins, and where the last one ends; most columns hold one value a tick and share these."""
    return _ones(len(ends)) if len(ends) == ends[-1] and ends == list(range(1, len(ends) + 1)) else _offsets(ends)


@cache
def _ones(count: int) -> pa.Array:
    return _offsets(range(1, count + 1))


def _offsets(ends: Sequence[int]) -> pa.Array:
    return pa.array(np.array([0, *ends], np.int32))


@lru_cache(maxsize=16)
def timelines(ticks: tuple[int, ...], starts_ns: tuple[int, ...]) -> tuple[ArrowColumn, ArrowColumn]:
    """Return the two timelines of a batch: `tick`, and `mono`, the grid time of the tick [ns]."""
    mono = pa.array(starts_ns, pa.int64()).cast(pa.duration("ns"))
    return ArrowColumn("tick", pa.array(ticks, pa.int64())), ArrowColumn("mono", mono)
