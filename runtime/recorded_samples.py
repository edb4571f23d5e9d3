"""The samples of a recording without the rest of it: what calibration reads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from drivers.interface.errors import ConfigurationError
from runtime.log.exact import consumed_schemas
from runtime.log.read import read, ticks


def recorded(log: Path, name: str) -> tuple[Any, ...]:
    """Return a field of `Sensed` at every tick of a recording, as it was; the other fields are not read.

    Raises:
        ConfigurationError: the file is not a recording of ours, damaged, or does not hold the field.
    """
    schema = consumed_schemas()[name]
    held, at = read(log, schema.entity), ticks(log)
    try:
        return tuple(schema.take(held.at(schema.entity, tick)) for tick in at)
    except ValueError as error:
        raise ConfigurationError(f"the log {log} does not hold '{name}': {error}") from error
