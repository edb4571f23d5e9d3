"""Where results go; whatever cannot be written there is found out before the run, not after it."""

from __future__ import annotations

import os
from itertools import count
from pathlib import Path

from drivers.interface.errors import ConfigurationError
from runtime.log.files.paths import files_of, stem_of

LOGS = Path("runs")


def log_path(asked: Path | None, stem: str, *, force: bool) -> Path:
    """Return the path to record to: the one asked for, or a new one in `runs/`.  Its folder is made.

    Raises:
        ConfigurationError: it is no .rrd file, exists while `force` is not given, or cannot be written.
    """
    path = asked or next(p for n in count() if not _existing(p := LOGS / f"{stem}-{n:03d}.rrd"))
    if path.suffix != ".rrd":
        raise ConfigurationError(f"--log takes a file that ends in .rrd, as the viewer does; not {path}")
    if stem_of(path) != path:
        raise ConfigurationError(f"--log {path} ends like one of several files of a log; choose a name without that number")
    existing = _existing(path)
    if existing and not force:
        raise ConfigurationError(f"--log {existing[0]} exists already; --force overwrites it")
    require_writable(path, "--log")
    for file in existing:
        if file != path:  # the writer overwrites that one itself
            _delete(file)
    return path


def _existing(path: Path) -> tuple[Path, ...]:
    """Return the files of a log that is there already."""
    return tuple(file for file in files_of(path) if file.exists())


def _delete(file: Path) -> None:
    try:
        file.unlink()
    except OSError as error:
        raise ConfigurationError(f"--log cannot overwrite {file}: {error.strerror}") from error


def require_writable(path: Path | None, option: str) -> None:
    """Check that a file can be written, and make its folder; None: it was not asked for.

    Raises:
        ConfigurationError: it cannot.
    """
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigurationError(f"the folder of {option} {path} cannot be made: {error.strerror}") from error
    if path.is_dir():
        raise ConfigurationError(f"{option} {path} is a folder, not a file")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise ConfigurationError(f"{option} {path} cannot be written: no permission, or the file system is read-only")


def write_text(path: Path, text: str) -> None:
    """Write a result that the user asked for.

    Raises:
        ConfigurationError: it cannot be written any more.
    """
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be written: {error.strerror}") from error
