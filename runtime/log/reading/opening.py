"""Opens a log file, or says in one sentence why it will not do."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from pathlib import Path

from rerun.chunk import Chunk, RrdReader
from rerun.error_utils import RerunWarning

from drivers.interface.errors import ConfigurationError
from runtime.log.files.paths import files_of
from runtime.log.files.recording import APPLICATION
from runtime.log.header import READABLE_SCHEMAS

RUN = "/run"  # what holds for the whole run


class DamagedLogError(ConfigurationError):
    """A log of ours that cannot be read as it is."""


def require_recording(path: Path) -> None:
    """Check that a file can be read and looks like a Rerun recording.

    Raises:
        ConfigurationError: it does not; says why.
    """
    if path.is_dir():
        raise ConfigurationError(f"there is no log {path}: it is a folder")
    if not path.is_file():
        raise ConfigurationError(f"there is no log {path}")
    if not os.access(path, os.R_OK):
        raise ConfigurationError(f"the log {path} cannot be read: no permission")
    if path.stat().st_size == 0:
        raise ConfigurationError(f"the log {path} is empty")
    with path.open("rb") as file:
        if not file.read(4).startswith(b"RRF"):
            raise ConfigurationError(f"{path} is not a Rerun recording")


def require_log(path: Path) -> None:
    """Check that a file is a log of ours.

    Raises:
        ConfigurationError: it is not; says why.
    """
    require_recording(path)
    try:
        applications = {entry.application_id for entry in reader_of(path).recordings()}
    except (RuntimeError, ValueError, OSError) as error:
        raise _damaged(path, error) from error
    if APPLICATION not in applications:
        raise ConfigurationError(f"{path} was not recorded by trundle but by {', '.join(sorted(applications)) or 'nobody'}")
    _require_schema(path)


def _require_schema(path: Path) -> None:
    version = schema_of(path)
    if version is None:
        raise DamagedLogError(f"the log {path} does not say which schema it has: it was cut off before that, or damaged")
    if version not in READABLE_SCHEMAS:
        known = ", ".join(str(known) for known in READABLE_SCHEMAS)
        raise ConfigurationError(f"the log {path} has schema {version}; this version of trundle reads {known}")


def chunks(path: Path, content: str) -> Iterator[Chunk]:
    """Yield the pieces of a log, or of all its files, that hold the entities matching `content`; a file's in no particular order.

    Raises:
        ConfigurationError: a file is not a log of ours, of another schema, or damaged.
    """
    for file in files_of(path):
        require_log(file)
        yield from chunks_of_file(file, content)


def chunks_of_file(file: Path, content: str) -> Iterator[Chunk]:
    """Yield the pieces of one file of a log.

    Raises:
        ConfigurationError: the file is damaged.
    """
    try:
        yield from reader_of(file).stream().filter(content=content)
    except (RuntimeError, ValueError, OSError) as error:
        raise _damaged(file, error) from error


def schema_of(file: Path) -> int | None:
    """Return the version of a file's replay columns; None: it does not say.

    Raises:
        ConfigurationError: the file is damaged.
    """
    for chunk in chunks_of_file(file, RUN):
        batch = chunk.to_record_batch()
        if "schema_version" in batch.schema.names:
            return int(batch.column("schema_version")[0].as_py()[0])
    return None


def reader_of(path: Path) -> RrdReader:
    """Return Rerun's reader of a log; it warns that there is no footer, which ours never have."""
    with warnings.catch_warnings(action="ignore", category=RerunWarning):
        return RrdReader(path)


def _damaged(path: Path, error: Exception) -> DamagedLogError:
    reason = str(error).splitlines()[0] if str(error) else type(error).__name__
    return DamagedLogError(f"the log {path} is cut or damaged ({reason}); `trundle log repair {path}` saves what can be read")
