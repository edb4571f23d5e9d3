"""Saves what can be read of a log that was cut in the middle of a message, or damaged within one."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from drivers.interface.errors import ConfigurationError
from runtime.log.files.marks import END, SEGMENT
from runtime.log.files.paths import files_of, stem_of
from runtime.log.reading.opening import require_log, require_recording
from runtime.log.reading.rescue import without_fatal

_PANICKED = 102  # exit code of Rerun's program


def rerun_program() -> str:
    """Return Rerun's own program: the `rerun` script would only start it, and could not be ended together with it.

    Raises:
        ConfigurationError: it is not installed.
    """
    package = find_spec("rerun_cli")
    if package is None or package.origin is None:
        raise ConfigurationError("the Rerun program is not installed: pip install rerun-sdk")
    return str(Path(package.origin).with_name("rerun"))


def quiet_environment() -> dict[str, str]:
    """Return the environment for Rerun's program: CI is what turns its analytics off."""
    return os.environ | {"CI": "1"}


def repair(damaged: Path, repaired: Path | None = None) -> Path:
    """Write all whole messages of a damaged log, or of all its files, to one other file; return its path.

    Without a path it is `NAME.repaired.rrd`, beside the log.

    Raises:
        ConfigurationError: nothing can be saved, or the other file exists or cannot be written.
    """
    path = repaired or stem_of(damaged).with_suffix(".repaired.rrd")
    if path.exists():
        raise ConfigurationError(f"{path} exists already; nothing is overwritten")
    if path.suffix != ".rrd":
        raise ConfigurationError(f"--output takes a file that ends in .rrd, as the viewer does; not {path}")
    files = files_of(damaged)
    if len(files) > 1:  # a writer that was killed has just begun the last of them
        files = tuple(file for file in files if not file.is_file() or file.stat().st_size)
    for file in files:
        require_recording(file)
    with TemporaryDirectory(dir=_folder(path), prefix=".repair-") as folder:
        saved = Path(folder) / path.name
        if not _save(files, saved):
            rescued = [_rescued(file, Path(folder) / str(index)) for index, file in enumerate(files)]
            _save(rescued, saved)
        try:
            require_log(saved)
        except ConfigurationError as error:
            raise ConfigurationError(f"nothing of {damaged} can be saved") from error
        saved.rename(path)
    return path


def _save(files: Sequence[Path], saved: Path) -> bool:
    """Write what can be read of files to another one; return whether Rerun's program lived to its own end."""
    # The marks of the files speak of others, and of bytes that are no longer the same.
    options = ["--continue-on-error", "--drop-entity", END, "--drop-entity", SEGMENT, "-o", str(saved)]
    command = [rerun_program(), "rrd", "filter", *map(str, files), *options]
    return subprocess.run(command, env=quiet_environment(), capture_output=True, check=False).returncode != _PANICKED


def _rescued(file: Path, folder: Path) -> Path:
    """Return a copy of a file without what Rerun's program does not survive."""
    folder.mkdir()
    copy = folder / "rescued.rrd"
    without_fatal(file, copy, lambda some: _save([some], folder / "tried.rrd"))
    return copy


def _folder(path: Path) -> Path:
    if not os.access(path.parent, os.W_OK):
        raise ConfigurationError(f"{path} cannot be written: there is no such folder, or no permission")
    return path.parent
