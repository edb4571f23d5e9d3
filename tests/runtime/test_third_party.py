"""A planner from somebody else's package is found through its entry point and drives the robot; ours is not touched."""

import json
import os
import subprocess
import sys
from pathlib import Path

PLANNER = '''
"""Somebody else's planner."""

import math

from drivers.interface.commands import BodyTwist
from drivers.interface.settings import Settings
from planners.planner import Plan


class CreepSettings(Settings):
    """How fast."""

    speed_m_s: float = 0.3


class Creep:
    """Creeps along the route."""

    Settings = CreepSettings
    default_shield = "none"

    def __init__(self, settings, setup):
        self._speed = settings.speed_m_s

    def warm_up(self):
        """Nothing to compile."""

    def plan(self, belief, route):
        if route.empty:
            return Plan(base=None)
        x, y = belief.odom_from_base.inverse().apply(route.path_in_odom[-1])
        return Plan(base=BodyTwist(self._speed, 0.0, math.atan2(y, x)), path_in_odom=route.path_in_odom)

    def snapshot(self):
        return b""

    def restore(self, snapshot):
        """Nothing to restore."""
'''
ENTRY_POINTS = "[trundle.planners]\ncreep = creeping_robots:Creep\n"
METADATA = "Metadata-Version: 2.1\nName: creeping-robots\nVersion: 1.0\n"
COMMAND = "import sys; from runtime.cli import run_command; sys.exit(run_command(sys.argv[1:]))"


def install(folder: Path) -> None:
    """Lay the package out as an installer does."""
    (folder / "creeping_robots.py").write_text(PLANNER)
    info = folder / "creeping_robots-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(METADATA)
    (info / "entry_points.txt").write_text(ENTRY_POINTS)


def trundle(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), os.getcwd()])}
    return subprocess.run(
        [sys.executable, "-c", COMMAND, *arguments], env=environment, capture_output=True, text=True, timeout=120, check=False
    )


def test_it_is_listed_and_drives(tmp_path: Path) -> None:
    install(tmp_path)
    listed = trundle(tmp_path, "list")
    assert "Creeps along the route." in listed.stdout
    goal = "mission.goals=[{x_m: 2.0, y_m: 0.0}]"
    changes = ["--set", "planner.name=creep", "--set", "planner.speed_m_s=0.4", "--set", goal]
    driven = trundle(tmp_path, "run", "static_corridor", *changes, "--no-log", "--json", str(tmp_path / "a.json"))
    assert driven.returncode == 0, driven.stderr
    report = json.loads((tmp_path / "a.json").read_text())
    assert (report["outcome"], report["planner"]) == ("reached", "creep")
    assert report["duration_s"] > (2.0 - 0.5 - 0.35) / 0.4
