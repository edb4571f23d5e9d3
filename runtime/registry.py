"""What can be chosen by name.  Ours and third parties' parts are registered alike, as entry points."""

from __future__ import annotations

import enum
import inspect
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from drivers.interface.errors import ConfigurationError, unknown_name


class Part(enum.Enum):
    """The kinds of parts that a configuration chooses by name; the value is the entry-point group."""

    PLANNER = "trundle.planners"
    ROUTER = "trundle.routers"
    SHIELD = "trundle.shields"
    ESTIMATOR = "trundle.estimators"
    DRIVER = "trundle.drivers"
    FIRMWARE = "trundle.firmware"  # by the name of the driver that it stands in for
    SCENARIO = "trundle.scenarios"

    @property
    def noun(self) -> str:
        """The word for it in a sentence."""
        return self.name.lower()


@cache  # reading every installed distribution's metadata takes tens of milliseconds, and a configuration asks ten times
def registered(part: Part) -> tuple[EntryPoint, ...]:
    """Return what is registered for a kind of part, as it stood when this process first asked."""
    return tuple(entry_points(group=part.value))


def names(part: Part) -> tuple[str, ...]:
    """Return every registered name, sorted."""
    return tuple(sorted({entry.name for entry in registered(part)}))


def load(part: Part, name: str) -> Any:
    """Return the class that is registered under a name.

    Raises:
        ConfigurationError: nothing is registered under it, or two distributions claim it, or it cannot be imported.
    """
    found = [entry for entry in registered(part) if entry.name == name]
    if not found:
        raise unknown_name(part.noun, name, names(part))
    if len({entry.value for entry in found}) > 1:
        claims = ", ".join(sorted(entry.value for entry in found))
        raise ConfigurationError(f"{part.noun} '{name}' is registered more than once: {claims}")
    return _import(part, found[0])


def first_line(part: Part, name: str) -> str:
    """Return the one line that `trundle list` shows: the first of the class's docstring."""
    return (inspect.getdoc(load(part, name)) or "").partition("\n")[0]


def _import(part: Part, entry: EntryPoint) -> Any:
    try:
        return entry.load()
    except (ImportError, AttributeError) as error:
        raise ConfigurationError(f"{part.noun} '{entry.name}' ({entry.value}) cannot be imported: {error}") from error
