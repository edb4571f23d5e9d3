"""Opens a log file, or says in one sentence why it will not do."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path

from rerun.chunk import Chunk, RrdReader
from rerun.error_utils import RerunWarning

from drivers.interface.errors import ConfigurationError
from runtime.log.recording import APPLICATION


def require_log(path: Path) -> None:
    """Check that a file is a log of ours.

    Raises:
        ConfigurationError: it is not; says why.
    """
    if not path.is_file():
        raise ConfigurationError(f"there is no log {path}")
    if path.stat().st_size == 0:
        raise ConfigurationError(f"the log {path} is empty")
    with path.open("rb") as file:
        if not file.read(4).startswith(b"RRF"):
            raise ConfigurationError(f"{path} is not a Rerun recording")
    try:
        applications = {entry.application_id for entry in reader_of(path).recordings()}
    except (RuntimeError, ValueError, OSError) as error:
        raise _damaged(path, error) from error
    if APPLICATION not in applications:
        raise ConfigurationError(f"{path} was not recorded by trundle but by {', '.join(sorted(applications)) or 'nobody'}")


def chunks(path: Path, content: str) -> Iterator[Chunk]:
    """Yield the pieces of a log that hold the entities matching `content`, in no particular order.

    Raises:
        ConfigurationError: the file is not a log of ours, or damaged.
    """
    require_log(path)
    try:
        yield from reader_of(path).stream().filter(content=content)
    except (RuntimeError, ValueError, OSError) as error:
        raise _damaged(path, error) from error


def reader_of(path: Path) -> RrdReader:
    """Return Rerun's reader of a log; it warns that there is no footer, which ours never have."""
    with warnings.catch_warnings(action="ignore", category=RerunWarning):
        return RrdReader(path)


def _damaged(path: Path, error: Exception) -> ConfigurationError:
    reason = str(error).splitlines()[0] if str(error) else type(error).__name__
    return ConfigurationError(
        f"the log {path} is damaged ({reason}); "
        f"`rerun rrd optimize --continue-on-error {path} -o REPAIRED.rrd` saves what can be read"
    )
