"""Writes what calibration found as a configuration that extends the calibrated one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from drivers.interface.errors import ConfigurationError


def write_extension(config: str, keys: dict[str, Any], path: Path) -> None:
    """Write a file that extends `config` by `keys`.

    Raises:
        ConfigurationError: the file cannot be written.
    """
    try:
        path.write_text(yaml.safe_dump({"extends": config} | keys, sort_keys=False), encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(f"--output {path} cannot be written: {error.strerror}") from error
