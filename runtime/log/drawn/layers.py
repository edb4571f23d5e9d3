"""What is drawn: one entity over time, picked from each cycle, collected tick by tick and sent as columns."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import rerun as rr

from drivers.interface.sensed import Tick
from runtime.cycle import Cycle
from runtime.log.exact.columns import ArrowColumn, timelines
from runtime.log.files.sink import Sink

T = TypeVar("T")
Static = Sequence[tuple[str, rr.AsComponents]]  # what holds for the whole run, by entity


@dataclass(slots=True, eq=False)
class Rows(Generic[T]):
    """The items of one entity since the last batch, and how they become columns."""

    entity: str
    build: Callable[[list[T]], Iterable[rr.ComponentColumn | ArrowColumn]]
    static: Static = ()  # logged once, before the first row
    _announced: bool = False
    _ticks: list[int] = field(default_factory=list)
    _starts_ns: list[int] = field(default_factory=list)
    _items: list[T] = field(default_factory=list)

    def add(self, tick: Tick, item: T) -> None:
        """Add a row at the tick."""
        self._ticks.append(tick.index)
        self._starts_ns.append(tick.start_ns)
        self._items.append(item)

    def send(self, sink: Sink) -> None:
        """Send the rows and start a new batch."""
        if not self._items:
            return
        if not self._announced:
            self._announced = True
            for entity, archetype in self.static:
                sink.log_static(entity, archetype)
        sink.send(self.entity, timelines(tuple(self._ticks), tuple(self._starts_ns)), self.build(self._items))
        self._ticks.clear()
        self._starts_ns.clear()
        self._items.clear()


@dataclass(slots=True, eq=False)
class Layer(Generic[T]):
    """Rows of what `pick` finds in a cycle: at every tick, or only when it is another than the last, or that not too often."""

    pick: Callable[[Cycle], T | None]
    rows: Rows[T]
    same: Callable[[T, T], bool] | None = None  # None: draw at every tick
    period_ns: int = 0  # least time between two rows
    _last: T | None = None
    _last_ns: int = 0

    def put(self, cycle: Cycle) -> None:
        """Draw the tick, if there is something new to draw."""
        item = self.pick(cycle)
        if item is None:
            return
        tick = cycle.sensed.tick
        if self.same is not None and self._last is not None and self._waits(item, self._last, tick.start_ns):
            return
        self._last, self._last_ns = item, tick.start_ns
        self.rows.add(tick, item)

    def send(self, sink: Sink) -> None:
        """Send the rows and start a new batch."""
        self.rows.send(sink)

    def _waits(self, item: T, last: T, now_ns: int) -> bool:
        assert self.same is not None
        return now_ns - self._last_ns < self.period_ns or self.same(item, last)


IDENTICAL = operator.is_  # arrays inside: the very same object
EQUAL = operator.eq
