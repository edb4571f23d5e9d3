"""The samples of a recording without the rest of it: what calibration reads."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drivers.interface.errors import ConfigurationError
from runtime.log.exact import consumed_schemas
from runtime.log.read import read, ticks


def recorded_ticks(log: Path) -> tuple[int, ...]:
    """Return every tick of a recording.  Raises ConfigurationError where it cannot be read."""
    return tuple(ticks(log))


def recorded(log: Path, name: str, at: Sequence[int] | None = None) -> tuple[Any, ...]:
    """Return a field of `Sensed` at ticks of a recording (None: at every one), as it was; the other fields are not read.

    Raises:
        ConfigurationError: the file is not a recording of ours, damaged, or does not hold the field.
    """
    schema = consumed_schemas()[name]
    held = read(log, schema.entity)
    try:
        return tuple(schema.take(held.at(schema.entity, tick)) for tick in (recorded_ticks(log) if at is None else at))
    except ValueError as error:
        raise ConfigurationError(f"the log {log} does not hold '{name}': {error}") from error
