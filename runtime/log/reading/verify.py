"""What replay needs of a log: what the loop consumed at each tick as it was, and whether it is undamaged."""

from __future__ import annotations

from functools import cache

from drivers.interface.errors import ConfigurationError
from drivers.interface.sensed import Sensed
from runtime.log.exact.part import consumed_schemas
from runtime.log.exact.schema import Schema
from runtime.log.exact.stream import rows
from runtime.log.reading.read import Log


def sensed_at(log: Log, tick: int) -> Sensed:
    """Return what the loop consumed at a tick, as it was.

    Raises:
        ConfigurationError: the log does not hold all of it.
    """
    try:
        parts = {name: schema.take(log.at(schema.entity, tick)) for name, schema in _schemas().items()}
    except ValueError as error:
        raise ConfigurationError(f"tick {tick} of {log.path} cannot be replayed: {error}") from error
    return Sensed(**parts)


def damaged_ticks(log: Log) -> list[int]:
    """Return the ticks whose checksum does not fit what the log holds of them."""
    return [row.tick for row in rows(log.path) if not row.is_sound]


@cache
def _schemas() -> dict[str, Schema]:
    return consumed_schemas()
