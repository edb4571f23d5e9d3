"""Reads a log in a process of its own, as Rerun's reader may end it on damage; `python -m` this module, WHAT and LOG."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from drivers.interface.errors import ConfigurationError
from runtime.log.files.paths import files_of
from runtime.log.reading.description import Description, describe
from runtime.log.reading.opening import DamagedLogError, require_recording
from runtime.log.reading.verification import Verification, verify

_CALLS: Mapping[str, Callable[[Path], Any]] = {"verify": verify, "describe": describe}


def verified(log: Path) -> Verification:
    """Return what `verify` finds.

    Raises:
        DamagedLogError: the log cannot be read as it is.
        ConfigurationError: it is none of ours.
    """
    found = _found("verify", log)
    lists = {name: tuple(found[name]) for name in ("damaged", "gaps", "findings")}
    return Verification(found["ticks"], found["first_tick"], found["last_tick"], **lists)


def described(log: Path) -> Description:
    """Return what `describe` finds.

    Raises:
        ConfigurationError: the log will not do.
    """
    found = _found("describe", log)
    return Description(tuple((name, value) for name, value in found["lines"]))


def _found(what: str, log: Path) -> dict[str, Any]:
    for file in files_of(log):
        require_recording(file)  # what needs no reader is said at once
    command = [sys.executable, "-m", "runtime.log.reading.isolated", what, str(log)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | {"RUST_LOG": "error"})
    try:
        said: dict[str, Any] = json.loads(done.stdout)
    except json.JSONDecodeError as error:
        advice = f"`trundle log repair {log}` saves what can be read"
        raise DamagedLogError(f"the log {log} is damaged so that Rerun's reader gave up; {advice}") from error
    if "error" in said:
        raise (DamagedLogError if said["damaged"] else ConfigurationError)(said["error"])
    return said


def _main(what: str, log: str) -> None:
    try:
        said = asdict(_CALLS[what](Path(log)))
    except ConfigurationError as error:
        said = {"error": str(error), "damaged": isinstance(error, DamagedLogError)}
    print(json.dumps(said))


if __name__ == "__main__":
    _main(*sys.argv[1:])
