"""One try of the arm's dead man: it is swung, the driver's process is ended or stopped, and its joints are watched."""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.faults.dead_man import Try, strike
from tests.faults.emulated import ROOT, children, until
from tests.ports import free_port
from tests.sim_drivers.firmware.fcibench import free_host

SWINGING_RAD_S, STANDING_RAD_S = 1.0, 0.02


@dataclass
class ArmScene:
    """An emulated arm's world in a process of its own."""

    host: str
    seen: np.ndarray

    @property
    def speed_rad_s(self) -> float:
        return float(self.seen[1])

    def attempt(self, blow: str) -> Try:
        """Swing, strike, watch."""
        with subprocess.Popen([sys.executable, "-m", "tests.faults.arm_commander", self.host], cwd=ROOT) as process:
            try:
                until(lambda: self.speed_rad_s > SWINGING_RAD_S or process.poll() is not None, "it never swung")
                assert process.poll() is None
                (io,) = children(process.pid)
                struck_s = time.monotonic()
                strike(process.pid, io, blow)
                still_s = self._stood_s()
                braked_s, late_s = self.seen[2:4].tolist()
                return Try(braked_s - struck_s, still_s - struck_s, late_s)
            finally:
                process.kill()

    def _stood_s(self) -> float:
        """Return since when the arm stands, once it has stood for a while."""
        since_s, deadline_s = None, time.monotonic() + 20.0
        while since_s is None or self.seen[0] - since_s < 0.1:
            now_s, speed = self.seen[:2].tolist()
            since_s = None if speed > STANDING_RAD_S else (since_s or now_s)
            assert time.monotonic() < deadline_s, "it never stood"
            time.sleep(0.001)
        return since_s


@contextmanager
def arm_scene() -> Iterator[ArmScene]:
    """Emulate the arm within the block."""
    host = free_host()
    with tempfile.TemporaryDirectory() as folder:
        memory = Path(folder) / "speed"
        memory.write_bytes(bytes(32))
        told = [sys.executable, "-m", "tests.faults.arm_world", host, str(free_port()), str(memory)]
        with subprocess.Popen(told, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
            try:
                assert process.stdout.readline() == "ready\n"
                yield ArmScene(host, np.memmap(memory, np.float64, "r", shape=(4,)))
            finally:
                process.kill()
