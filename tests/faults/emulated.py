"""Worlds and runs in processes of their own, on ports that nobody else uses, and someone who watches from outside."""

import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import can

from drivers.interface.samples import TruthSample
from drivers.interface.truth_wire import LARGEST_DATAGRAM, WATCH, decode
from tests.ports import free_port

COMMAND = "from runtime.cli import main; main()"
GROUP = "239.74.163.2"
PATIENCE_S = 60.0  # other work may share the machine
ROOT = Path(__file__).parents[2]


def until(holds: Callable[[], bool], what: str) -> None:
    """Wait for something, with patience."""
    deadline_s = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < deadline_s, what
        time.sleep(0.01)


@dataclass
class EmulatedRobot:
    """`trundle emulate` of the XLeRobot, or of another robot with its base, on ports of its own."""

    robot: str = "xlerobot_emulated"
    wires: tuple[str, ...] = (  # the robot's own, with a free port
        "robot.base.bus.port={port}", "robot.base.connect_s=20",
        "robot.camera.memory=faults-{port}", "robot.imu.memory=faults-{port}",
    )  # fmt: skip
    scenario: str = "square"
    can_port: int = field(default_factory=free_port)
    truth_port: int = field(default_factory=free_port)
    lines: list[str] = field(default_factory=list)

    @property
    def overrides(self) -> tuple[str, ...]:
        """What emulation and run must both be told."""
        return (
            f"robot={self.robot}", f"robot.truth.port={self.truth_port}", "robot.truth.open_timeout_s=30",
            *(wire.format(port=self.can_port) for wire in self.wires),
        )  # fmt: skip

    @property
    def changes(self) -> list[str]:
        """The same for a command line."""
        return [word for change in self.overrides for word in ("--set", change)]

    @property
    def worlds(self) -> int:
        """How many worlds have been ready."""
        return sum(line.startswith("ready") for line in list(self.lines))

    def run(self, *arguments: str, **options: object) -> "subprocess.Popen[str]":
        """Start `trundle run` against it."""
        return trundle("run", "square", *self.changes, "--set", "planner.stop_before_unknown=false", *arguments, **options)

    def bus(self) -> can.BusABC:
        """Join its CAN bus."""
        return can.Bus(interface="udp_multicast", channel=GROUP, port=self.can_port, hop_limit=0, fd=False)

    @contextmanager
    def watched(self) -> Iterator["Watcher"]:
        """Watch the truth, without being a run."""
        watcher = Watcher(self.truth_port)
        try:
            yield watcher
        finally:
            watcher.close()


def trundle(*arguments: str, **options: object) -> "subprocess.Popen[str]":
    command = [sys.executable, "-c", COMMAND, *arguments]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    told = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.Popen(command, env=environment, **(told | options))


@contextmanager
def emulated(*changes: str, **of_robot: Any) -> Iterator[EmulatedRobot]:
    """Emulate within the block; the world's process is put before others where that is permitted."""
    emulation = EmulatedRobot(**of_robot)
    more = [word for change in (*changes, "loop.system.priority=20") for word in ("--set", change)]
    process = trundle("emulate", emulation.scenario, *emulation.changes, *more)
    reader = threading.Thread(target=lambda: emulation.lines.extend(iter(process.stdout.readline, "")))
    reader.start()
    try:
        until(lambda: emulation.worlds > 0 or process.poll() is not None, "the emulation never became ready")
        assert emulation.worlds > 0, emulation.lines
        yield emulation
    finally:
        process.terminate()
        try:
            process.wait(PATIENCE_S)
        finally:
            process.kill()
            reader.join()
            process.stdout.close()


class Watcher:
    """Someone who sees how things are in an emulated world."""

    def __init__(self, port: int) -> None:
        self._link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._link.connect(("127.0.0.1", port))
        self._link.settimeout(0.2)
        self._leave = threading.Event()
        self.newest: TruthSample | None = None
        self.late_ns = 0  # for how long the world has stood still
        self._thread = threading.Thread(target=self._watch)
        self._thread.start()

    @property
    def speed_m_s(self) -> float:
        return 0.0 if self.newest is None else self.newest.twist.speed_m_s

    def close(self) -> None:
        self._leave.set()
        self._thread.join()
        self._link.close()

    def _watch(self) -> None:
        asked_s = 0.0
        while not self._leave.is_set():
            with suppress(OSError):
                if time.monotonic() - asked_s > 0.25:
                    asked_s = time.monotonic()
                    self._link.send(WATCH)
                look = decode(self._link.recv(LARGEST_DATAGRAM), time.monotonic_ns())
                self.newest, self.late_ns = look.sample, look.late_ns


def children(pid: int) -> list[int]:
    """Return the child processes of one of ours."""
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for task in tasks for child in task.read_text().split()]
