"""How many of fifty recordings, killed at a random moment, hold all that is older than the flush interval, undamaged."""

from pathlib import Path
from tempfile import TemporaryDirectory

from tests.benchmarks.figure import Figure
from tests.runtime.kill import lost_after_kill

TRIES = 50


def figures() -> list[Figure]:
    """Record, kill and verify; `make bench ARGS=kill`."""
    with TemporaryDirectory() as folder:
        losses = [loss for seed in range(TRIES) if (loss := lost_after_kill(Path(folder), seed))]
    for loss in losses:
        print(loss)
    return [Figure("killed_recordings_whole", TRIES - len(losses), unit=f"of {TRIES}")]
