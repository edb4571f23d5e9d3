"""Which ticks of a log can be replayed in one go: a tick that is missing or damaged ends a stretch, a key frame begins one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from runtime.log.exact.block import Row


class Stretches:
    """Iterates over stretches, each an iterator over its rows; it is to be used up before the next is asked for."""

    def __init__(self, rows: Iterable[Row], first: int, last: int | None) -> None:
        """Take the rows of the ticks from `first` to `last`."""
        self._rows = iter(rows)
        self._first, self._last = first, last
        self._held: Row | None = None
        self.passed_over = 0  # ticks in none of them
        self.damaged: list[int] = []

    def __iter__(self) -> Iterator[Iterator[Row]]:
        """Yield every stretch."""
        while (row := self._beginning()) is not None:
            yield self._from(row)

    def _beginning(self) -> Row | None:
        """Return the next tick that is known how to begin with: the run's first, or one with a key frame."""
        while (row := self._next()) is not None:
            if self._is_sound(row) and (row.has_key_frame or (row.tick == 0 and not row.lost_before)):
                return row
            self.passed_over += 1
        return None

    def _from(self, row: Row) -> Iterator[Row]:
        while True:
            yield row
            following = self._next()
            if following is None:
                return
            if not self._is_sound(following) or following.lost_before or following.tick != row.tick + 1 + following.skipped:
                self._held = following
                return
            row = following

    def _is_sound(self, row: Row) -> bool:
        if row.is_sound:
            return True
        if row.tick not in self.damaged:
            self.damaged.append(row.tick)
        return False

    def _next(self) -> Row | None:
        if self._held is not None:
            row, self._held = self._held, None
            return row
        for row in self._rows:
            if self._last is not None and row.tick > self._last:
                return None
            if row.tick >= self._first:
                return row
        return None
