"""What is wrong with a log, said before Rerun's reader meets it: on some flipped bits that reader ends the whole process."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from drivers.interface.errors import ConfigurationError
from runtime.log.exact.part import CHECK
from runtime.log.exact.times import starts_ns
from runtime.log.files.paths import files_of
from runtime.log.files.seal import Seal, seal_of
from runtime.log.reading.isolated import verified
from runtime.log.reading.opening import DamagedLogError, require_log, require_recording
from runtime.log.reading.repair import repair
from runtime.log.reading.verification import Verification


@dataclass(frozen=True, slots=True)
class Damage:
    """What is wrong with a log."""

    sentences: tuple[str, ...] = ()
    is_altered: bool = False  # since it was written; a log whose writer was killed is not
    is_readable: bool = True  # the reader does without what is damaged


def damage_of(log: Path) -> Damage:
    """Return what is wrong with a log; a sum over its bytes tells that nothing is, only else is it read in another process.

    Raises:
        ConfigurationError: it is not a log of ours, or of another schema.
    """
    files = files_of(log)
    for file in files:
        require_recording(file)
    seals = set(map(seal_of, files))
    if seals == {Seal.WHOLE}:
        require_log(files[0])
        return Damage()
    try:
        return Damage(verified(log).findings, is_altered=Seal.BROKEN in seals)
    except DamagedLogError as error:
        return Damage((f"{error}; {_saved_extent(log)}",), is_altered=True, is_readable=False)


def _saved_extent(log: Path) -> str:
    """Say how far the ticks are whole in what can be saved of the log."""
    with TemporaryDirectory() as folder:
        try:
            saved = repair(log, Path(folder) / "saved.rrd")
            found = verified(saved)
        except ConfigurationError:
            return "nothing of it can be saved"
        return _extent(found, sorted(starts_ns(saved, CHECK)))


def _extent(found: Verification, ticks: list[int]) -> str:
    """Say how far all ticks can be saved whole."""
    before_gaps = (max((tick for tick in ticks if tick < gap), default=-1) + 1 for gap in found.gaps)
    first = min((*found.damaged, *before_gaps), default=None)
    if first is None:
        return f"its ticks are whole up to {found.last_tick}, and none after it can be read"
    return f"tick {first} is the first that is damaged or missing"
