"""The exception base.  Every message is one readable sentence; the command line prints it and nothing else."""

from collections.abc import Iterable
from difflib import get_close_matches


class TrundleError(Exception):
    """Base of every error that Trundle raises on purpose; `exit_code` is what the command line returns."""

    exit_code = 1


class ConfigurationError(TrundleError):
    """The configuration, a file or the usage is wrong; names the file, the key and the valid choices."""

    exit_code = 2


class DeviceError(TrundleError):
    """A device is missing, refused to open or failed; names the device."""

    exit_code = 3


def unknown_name(kind: str, name: str, known: Iterable[str]) -> ConfigurationError:
    """Return the error for a name that nothing answers to, with the valid names and the nearest one.

    >>> str(unknown_name("planner", "dwaa", ["dwa", "point_ds"]))
    "unknown planner 'dwaa'; did you mean 'dwa'? Known: dwa, point_ds"
    """
    names = sorted(known)
    near = get_close_matches(name, names, n=1)
    hint = f"did you mean '{near[0]}'? " if near else ""
    return ConfigurationError(f"unknown {kind} '{name}'; {hint}Known: {', '.join(names) or 'none'}")
