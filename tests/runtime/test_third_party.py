"""A planner from somebody else's package is found through its entry point and drives the robot; ours is not touched."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from runtime.log.reading import read

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
COMMAND = "from runtime.cli import main; main()"


def install(folder: Path, more: str = "") -> None:
    """Lay the package out as an installer does; `more` is code that stands behind the planner's."""
    (folder / "creeping_robots.py").write_text(PLANNER + more)
    info = folder / "creeping_robots-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(METADATA)
    (info / "entry_points.txt").write_text(ENTRY_POINTS)


def environment(folder: Path) -> dict[str, str]:
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), os.getcwd()])}


def trundle(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", COMMAND, *arguments]
    return subprocess.run(command, env=environment(folder), capture_output=True, text=True, timeout=120, check=False)


CREEPING = ("run", "static_corridor", "--set", "planner.name=creep")


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


@pytest.mark.parametrize(
    ("more", "code", "told"),
    [
        (
            "def broken(self, settings, setup): raise ZeroDivisionError('by zero')\nCreep.__init__ = broken",
            2,
            "error: 'creep' cannot be built: Zero",
        ),
        ("def broken(self): raise ZeroDivisionError('by zero')\nCreep.warm_up = broken", 1, "error: ZeroDivisionError: by zero"),
        ("def broken(self, belief, route): return None\nCreep.plan = broken", 1, "planner_raised"),
        ("def broken(self, belief, route): raise SystemExit(0)\nCreep.plan = broken", 1, "SystemExit: 0"),
    ],
)
def test_a_broken_one_is_told_in_a_sentence(more: str, code: int, told: str, tmp_path: Path) -> None:
    install(tmp_path, more)
    driven = trundle(tmp_path, *CREEPING, "--no-log", "--duration", "1")
    assert driven.returncode == code, driven.stderr
    assert told in driven.stdout + driven.stderr
    assert "Traceback" not in driven.stderr


HANG = """
import pathlib, time

def hang(self, *inputs):
    pathlib.Path(__file__).with_name("hangs").touch()
    time.sleep(1000)

Creep.{method} = hang
"""


def hanging(folder: Path, method: str, *arguments: str) -> subprocess.Popen[str]:
    """Start a run and return when it hangs in a method of the planner."""
    install(folder, HANG.format(method=method))
    command = [sys.executable, "-c", COMMAND, *CREEPING, *arguments]
    told = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    run = subprocess.Popen(command, env=environment(folder), **told)
    deadline = time.monotonic() + 60
    while not (folder / "hangs").exists():
        assert run.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return run


@pytest.mark.parametrize("latency", [0, 2])
def test_one_that_hangs_is_left_by_the_second_ctrl_c(latency: int, tmp_path: Path) -> None:
    log, report = tmp_path / "a.rrd", tmp_path / "a.json"
    outputs = ["--log", str(log), "--json", str(report)]
    with hanging(tmp_path, "plan", "--set", f"planner.latency_ticks={latency}", *outputs) as run:
        run.send_signal(signal.SIGINT)
        try:  # asked to end, it waits for the planner; with a latency the loop may not yet have come to where it waits
            run.wait(1.0)
            assert latency > 0
        except subprocess.TimeoutExpired:
            run.send_signal(signal.SIGINT)
        _, complaint = run.communicate(timeout=30)
    assert run.returncode == 130
    assert "Traceback" not in complaint
    told = json.loads(report.read_text())
    assert told["outcome"] == "interrupted"
    assert len(read.ticks(log)) == told["ticks"] <= latency


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_while_kernels_compile_one_signal_ends_it(number: signal.Signals, tmp_path: Path) -> None:
    with hanging(tmp_path, "warm_up", "--log", str(tmp_path / "a.rrd")) as run:
        run.send_signal(number)
        _, complaint = run.communicate(timeout=30)
    assert run.returncode == 130
    assert complaint == ""
    assert not (tmp_path / "a.rrd").exists()
