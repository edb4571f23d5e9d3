"""The samples of a recording without the rest of it: what calibration reads."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from runtime.log.exact.stream import rows
from runtime.log.reading.read import ticks


def recorded_ticks(log: Path) -> tuple[int, ...]:
    """Return every tick of a recording.  Raises ConfigurationError where it cannot be read."""
    return tuple(ticks(log))


def recorded(log: Path, name: str, at: Sequence[int] | None = None) -> tuple[Any, ...]:
    """Return a field of `Sensed` at ticks of a recording (None: at every one), as it was; the other fields may be missing.

    Raises:
        ConfigurationError: the file is not a recording of ours, damaged, or does not hold the field.
    """
    found = {row.tick: row.consumed(name) for row in rows(log) if at is None or row.tick in at}
    return tuple(found[tick] for tick in (found if at is None else at))
