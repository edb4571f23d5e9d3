"""Compares what the loop decides with what was recorded, column by column, as the log stores it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from runtime.cycle import Cycle
from runtime.log.exact.block import Row, Values
from runtime.log.exact.columns import Column, Kind
from runtime.log.exact.part import decided_schemas
from runtime.log.exact.schema import Schema

DIGEST = "crc32"  # the last part of the name of a checksum's column


@dataclass(frozen=True, slots=True)
class Difference:
    """One field that differs."""

    tick: int
    field: str  # "plan.base.vx"; of an array with its index
    recorded: str
    replayed: str

    def __str__(self) -> str:
        """Return it as a sentence."""
        return f"{self.field} differs at tick {self.tick}: recorded {self.recorded}, replayed {self.replayed}"


class Comparison:
    """Holds what the loop decides against what was recorded, a block of ticks at a time; only where it differs, tick by tick.

    Exactly: every bit, grids by their checksums.  Within a tolerance: numbers by |a - b| <= tolerance * max(1, |a|, |b|), all
    else exactly, and checksums not at all.
    """

    def __init__(self, tolerance: float | None) -> None:
        """Compare within the tolerance; None: exactly."""
        self._tolerance = tolerance
        self._schemas = decided_schemas()
        self._rows: list[Row] = []  # those put since the last comparison, one after the other in one block
        self.first: Difference | None = None
        self.differing_ticks = 0

    def put(self, cycle: Cycle, row: Row) -> None:
        """Add a tick."""
        if self._rows and self._rows[-1].block is not row.block:
            self.finish()
        self._rows.append(row)
        for name, schema in self._schemas.items():
            schema.put(getattr(cycle, name))

    def finish(self) -> None:
        """Compare what was added."""
        columns = [column for name, schema in self._schemas.items() for column in self._different(name, schema)]
        for index, row in enumerate(self._rows if columns else ()):
            found = next(self._differences(columns, index, row.tick), None)
            self.differing_ticks += found is not None
            self.first = self.first or found
        for schema in self._schemas.values():
            schema.clear()
        self._rows.clear()

    def _different(self, name: str, schema: Schema) -> Iterator[_Pair]:
        """Yield the columns of an entity that are not the same to the bit."""
        if not self._rows:
            return
        first, last = self._rows[0].index, self._rows[-1].index
        recorded = self._rows[0].block.values(schema.entity)
        for column in {**schema.columns, **recorded}:
            pair = _Pair(f"{name}.{column}", schema.columns.get(column), recorded.get(column), first)
            if not pair.is_same(last):
                yield pair

    def _differences(self, columns: list[_Pair], index: int, tick: int) -> Iterator[Difference]:
        for pair in columns:
            recorded, replayed = pair.at(index)
            if not self._same(pair, recorded, replayed):
                yield _difference(tick, pair.field, recorded, replayed)

    def _same(self, pair: _Pair, recorded: list[Any], replayed: list[Any]) -> bool:
        if self._tolerance is not None and pair.field.endswith(DIGEST):
            return True
        if not pair.is_float:
            return recorded == replayed
        if self._tolerance is None:
            return _bits(recorded) == _bits(replayed)
        return len(recorded) == len(replayed) and all(map(self._near, recorded, replayed))

    def _near(self, one: float, other: float) -> bool:
        assert self._tolerance is not None
        if math.isnan(one) or math.isnan(other) or math.isinf(one) or math.isinf(other):
            return str(one) == str(other)
        return abs(one - other) <= self._tolerance * max(1.0, abs(one), abs(other))


@dataclass(frozen=True, slots=True)
class _Pair:
    """One column on both sides; None: it is not there, and so empty."""

    field: str
    replayed: Column | None
    recorded: Values | None
    first: int  # the place in the block of the first tick replayed

    @property
    def is_float(self) -> bool:
        """Whether it holds numbers that are compared by their bits."""
        return self.replayed is not None and self.replayed.kind is Kind.FLOAT

    def is_same(self, last: int) -> bool:
        """Whether both are the same to the bit from the first tick to the last, by their place in the block."""
        ends = np.array(self.replayed.ends if self.replayed is not None else [0] * (last + 1 - self.first))
        own = self.replayed.values if self.replayed is not None else []
        if self.recorded is None:
            return not own
        start = self.recorded.ends[self.first - 1] if self.first else 0
        recorded = self.recorded.values[start : self.recorded.ends[last]]
        if not np.array_equal(self.recorded.ends[self.first : last + 1] - start, ends):
            return False
        return _bits(recorded) == _bits(own) if self.is_float else list(recorded) == own

    def at(self, index: int) -> tuple[list[Any], list[Any]]:
        """Return the recorded and the replayed values of one of the ticks."""
        recorded = [] if self.recorded is None else self.recorded.at(self.first + index)
        if self.replayed is None:
            return _listed(recorded), []
        start, end = self.replayed.ends[index - 1] if index else 0, self.replayed.ends[index]
        return _listed(recorded), self.replayed.values[start:end]


def _bits(values: Sequence[Any] | NDArray[Any]) -> bytes:
    """Return numbers bit by bit: NaN equals itself, 0.0 is not -0.0."""
    return np.asarray(values, np.float64).tobytes()


def _listed(values: Sequence[Any] | NDArray[Any]) -> list[Any]:
    return values.tolist() if isinstance(values, np.ndarray) else list(values)


def _difference(tick: int, field: str, recorded: Sequence[Any], replayed: Sequence[Any]) -> Difference:
    pairs = list(zip_longest(recorded, replayed))
    at = next((i for i, (one, other) in enumerate(pairs) if repr(one) != repr(other)), 0)
    one, other = pairs[at]
    where = f"{field}[{at}]" if len(pairs) > 1 else field
    return Difference(tick, where, _shown(one), _shown(other))


def _shown(value: Any) -> str:
    return "nothing" if value is None else repr(value)
