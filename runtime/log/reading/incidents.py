"""A recording of its own of each latched stop, made when the robot stands and the log is closed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from runtime.log.files.stops import AROUND_S
from runtime.log.reading.cut import cut

MOST = 5  # of one log; the first are kept, as later ones mostly follow from them


def bundle(log: Path, latched_ticks: Sequence[int]) -> tuple[Path, ...]:
    """Cut out what happened around the latched stops; return the paths, `LOG.incident-TICK.rrd`.

    A recording of the same name is from an earlier run that this log overwrote.

    Raises:
        ConfigurationError: the log will not do, or a recording cannot be written.
        OSError: an earlier recording cannot be replaced.
    """
    paths = []
    for tick in latched_ticks[:MOST]:
        path = log.with_suffix(f".incident-{tick}.rrd")
        path.unlink(missing_ok=True)
        paths.append(cut(log, tick, AROUND_S, path))
    return tuple(paths)
