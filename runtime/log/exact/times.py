"""When the ticks of a log were."""

from __future__ import annotations

from pathlib import Path

from runtime.log.reading.carried import piece_of
from runtime.log.reading.opening import chunks


def starts_ns(log: Path, entity: str) -> dict[int, int]:
    """Return the grid time of every tick that an entity has a row for [ns], in order.

    Raises:
        ConfigurationError: the log will not do.
    """
    found: dict[int, int] = {}
    for chunk in chunks(log, entity):
        piece = piece_of(chunk)
        found |= dict(zip(piece.ticks, piece.starts_ns, strict=True))
    return dict(sorted(found.items()))
