"""Where a run is recorded: where the user says, or a new file in `runs/`; an existing log is never overwritten unasked."""

from itertools import count
from pathlib import Path

from drivers.interface.errors import ConfigurationError

FOLDER = Path("runs")


def log_path(asked: Path | None, stem: str, *, force: bool) -> Path:
    """Return the path to record to, its folder made.

    Raises:
        ConfigurationError: the file exists and `force` is not given, or the folder cannot be made.
    """
    path = asked or next(p for n in count() if not (p := FOLDER / f"{stem}-{n:03d}.rrd").exists())
    if path.exists() and not force:
        raise ConfigurationError(f"--log {path} exists already; --force overwrites it")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigurationError(f"the folder of --log {path} cannot be made: {error.strerror}") from error
    return path
