"""Saves what can be read of a log that was cut in the middle of a message, or damaged within one."""

from __future__ import annotations

import os
import subprocess
from importlib.util import find_spec
from pathlib import Path

from drivers.interface.errors import ConfigurationError
from runtime.log.opening import require_log


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


def repair(damaged: Path, repaired: Path) -> None:
    """Write all whole messages of a damaged log to another file, which must not exist.

    Raises:
        ConfigurationError: nothing can be saved, or the other file exists.
    """
    if repaired.exists():
        raise ConfigurationError(f"{repaired} exists already; nothing is overwritten")
    command = [rerun_program(), "rrd", "optimize", "--continue-on-error", str(damaged), "-o", str(repaired)]
    subprocess.run(command, env=quiet_environment(), capture_output=True, check=False)
    try:
        require_log(repaired)
    except ConfigurationError as error:
        repaired.unlink(missing_ok=True)
        raise ConfigurationError(f"nothing of {damaged} can be saved") from error
