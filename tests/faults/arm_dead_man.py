"""One try of the arm's dead man: it is swung, the driver's process is ended or stopped, and its joints are watched."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.faults.emulated import ROOT, children, free_port, until
from tests.sim_drivers.firmware.fcibench import free_host

SWINGING_RAD_S, STANDING_RAD_S = 1.0, 0.02


@dataclass(frozen=True)
class ArmTry:
    """What followed."""

    speed_rad_s: float  # at the blow
    still_s: float  # from the blow until the arm stood


@dataclass
class ArmScene:
    """An emulated arm's world in a process of its own."""

    host: str
    seen: np.ndarray

    @property
    def speed_rad_s(self) -> float:
        return float(self.seen[1])

    def attempt(self, blow: str) -> ArmTry:
        """Swing, strike, watch.  `blow`: kill or stop the runtime, or kill_io, the process at the wire."""
        with subprocess.Popen([sys.executable, "-m", "tests.faults.arm_commander", self.host], cwd=ROOT) as process:
            try:
                until(lambda: self.speed_rad_s > SWINGING_RAD_S or process.poll() is not None, "it never swung")
                assert process.poll() is None
                (io,) = children(process.pid)
                struck_s, speed = time.monotonic(), self.speed_rad_s
                os.kill(io if blow == "kill_io" else process.pid, signal.SIGSTOP if blow == "stop" else signal.SIGKILL)
                if blow == "kill_io":  # whoever starts another process at the wire would come back
                    os.kill(process.pid, signal.SIGSTOP)
                return ArmTry(speed, self._stood_s() - struck_s)
            finally:
                process.kill()

    def _stood_s(self) -> float:
        """Return since when the arm stands, once it has stood for a while."""
        since_s, deadline_s = None, time.monotonic() + 20.0
        while since_s is None or self.seen[0] - since_s < 0.1:
            now_s, speed = self.seen.tolist()
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
        memory.write_bytes(bytes(16))
        told = [sys.executable, "-m", "tests.faults.arm_world", host, str(free_port()), str(memory)]
        with subprocess.Popen(told, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
            try:
                assert process.stdout.readline() == "ready\n"
                yield ArmScene(host, np.memmap(memory, np.float64, "r", shape=(2,)))
            finally:
                process.kill()
