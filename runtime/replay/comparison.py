"""Compares what the loop decides with what was recorded, column by column, as the log stores it."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

from runtime.cycle import Cycle
from runtime.log.columns import Kind
from runtime.log.exact import decided_schemas
from runtime.log.schema import Schema
from runtime.log.stream import Row

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
    """Holds each tick against its row.

    Exactly: every bit, grids by their checksums.  Within a tolerance: numbers by |a - b| <= tolerance * max(1, |a|, |b|), all
    else exactly, and checksums not at all.
    """

    def __init__(self, tolerance: float | None) -> None:
        """Compare within the tolerance; None: exactly."""
        self._tolerance = tolerance
        self._schemas = decided_schemas()

    def differences(self, cycle: Cycle, row: Row) -> Iterator[Difference]:
        """Yield what differs: the belief's fields first, then the route's, the plan's and the verdict's."""
        for name, schema in self._schemas.items():
            schema.put(getattr(cycle, name))
            for column, recorded, replayed in _pairs(schema, row):
                if not self._same(schema, column, recorded, replayed):
                    yield _difference(cycle.sensed.tick.index, f"{name}.{column}", recorded, replayed)
            schema.clear()

    def _same(self, schema: Schema, column: str, recorded: Sequence[Any], replayed: Sequence[Any]) -> bool:
        kind = schema.columns[column].kind if column in schema.columns else Kind.TEXT
        if self._tolerance is not None and column.endswith(DIGEST):
            return True
        if kind is not Kind.FLOAT:
            return list(recorded) == list(replayed)
        if self._tolerance is None:
            return array("d", recorded).tobytes() == array("d", replayed).tobytes()  # NaN equals itself, 0.0 is not -0.0
        return len(recorded) == len(replayed) and all(map(self._near, recorded, replayed))

    def _near(self, one: float, other: float) -> bool:
        assert self._tolerance is not None
        if math.isnan(one) or math.isnan(other) or math.isinf(one) or math.isinf(other):
            return str(one) == str(other)
        return abs(one - other) <= self._tolerance * max(1.0, abs(one), abs(other))


def _pairs(schema: Schema, row: Row) -> Iterator[tuple[str, Sequence[Any], Sequence[Any]]]:
    """Yield every column that either side has values in: its name, the recorded ones, the replayed ones."""
    recorded = row.cells(schema.entity)
    for name, column in schema.columns.items():
        if column.values or name in recorded:
            yield name, recorded.get(name, ()), column.values
    for name, values in recorded.items():
        if name not in schema.columns:
            yield name, values, ()


def _difference(tick: int, field: str, recorded: Sequence[Any], replayed: Sequence[Any]) -> Difference:
    pairs = list(zip_longest(recorded, replayed))
    at = next((i for i, (one, other) in enumerate(pairs) if repr(one) != repr(other)), 0)
    one, other = pairs[at]
    where = f"{field}[{at}]" if len(pairs) > 1 else field
    return Difference(tick, where, _shown(one), _shown(other))


def _shown(value: Any) -> str:
    return "nothing" if value is None else repr(value)
