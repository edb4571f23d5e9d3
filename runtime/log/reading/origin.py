"""What a log says of its run: where it comes from, and what made it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from drivers.interface.geometry import SE3
from runtime.log.header import ArmShape, RunHeader
from runtime.log.reading.opening import RUN
from runtime.log.reading.read import STATIC, read


def header_of(log: Path) -> RunHeader:
    """Return the header that a log was recorded with, but for the scene: that stands in the log as it is drawn.

    Raises:
        ConfigurationError: the log will not do.
    """
    said = read(log, RUN).at(RUN, STATIC)

    def one(name: str) -> Any:
        return said[name][0] if name in said else ""

    robot = yaml.safe_load(one("configuration")).get("robot") or {}
    devices = tuple(name for name, value in robot.items() if isinstance(value, dict))
    return RunHeader(
        configuration_yaml=one("configuration"),
        seed=int(one("seed")),
        scenario=one("scenario"),
        planner=one("planner"),
        robot_radius_m=float(robot.get("radius_m", 0.0)),
        robot_height_m=float(robot.get("height_m", 0.0)),
        devices=devices,
        arm=ArmShape(SE3(), ()) if "arm" in devices else None,
        code_version=one("code_version"),
        code_modified=bool(one("code_modified")),
        libraries=tuple(said.get("libraries", ())),
        machine=one("machine"),
        doctor=one("doctor"),
    )
