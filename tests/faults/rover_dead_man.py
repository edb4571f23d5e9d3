"""One try of the rover's dead man: it is driven, its driver's process is ended or stopped, and the autopilot is watched.

`python -m tests.faults.rover_dead_man URL VX` is the runtime, reduced to its base: it drives until it is told to stop, or ended.
"""

import math
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceSetup
from drivers.rover_serial.driver import RoverBase
from sim_drivers.scenarios.square import Square, SquareSettings
from sim_drivers.world import MujocoWorld, WorldSettings
from tests.contract.rigs import FreeRunning, Rig
from tests.faults.dead_man import DRIVING, Try, strike
from tests.faults.emulated import ROOT, children, until
from tests.faults.told import until_told
from tests.ports import free_port

LIFETIME_NS = 250_000_000
FULL_M_S, STANDING_M_S = 0.9, 0.02


class Rover:
    """An autopilot in a world of its own, beside the test."""

    def __init__(self) -> None:
        self.url = f"tcp:127.0.0.1:{free_port()}"
        self.world = MujocoWorld(Square(SquareSettings(side_m=40.0)).draw(0), WorldSettings())
        rig = Rig({}, {"boot_s": 0.0, "estimate_s": 0.0})
        self.running = FreeRunning("rover_serial", RoverBase.Settings(url=self.url), rig, self.world, 1)
        self.world.compile()
        self._timeouts = 0

    @property
    def speed_m_s(self) -> float:
        vx, vy = self.world.data.qvel[:2]
        return math.hypot(vx, vy)

    @property
    def timeouts(self) -> int:
        """How often the autopilot itself had to stop because nothing was asked of it any more."""
        return self.running._firmware.state.timeouts

    @property
    def timed_out(self) -> bool:
        """Whether it had to since the last blow."""
        return self.timeouts > self._timeouts

    @property
    def is_told_to_drive(self) -> bool:
        state = self.running._firmware.state
        return state.armed and state.follows and state._order is not None and state._order.speed_m_s != 0.0

    def attempt(self, blow: str, vx_m_s: float) -> Try:
        """Drive, strike, watch."""
        arguments = [sys.executable, "-m", "tests.faults.rover_dead_man", self.url, str(vx_m_s)]
        with subprocess.Popen(arguments, cwd=ROOT) as process:
            try:
                until(lambda: self.speed_m_s > DRIVING * abs(vx_m_s), "it never drove")
                (io,) = children(process.pid)
                struck_s, self._timeouts = time.monotonic(), self.timeouts
                strike(process.pid, io, blow)
                safe_s, late_ns = _when(lambda: not self.is_told_to_drive) - struck_s, self.running.late_ns
                still_s = _when(lambda: self.speed_m_s < STANDING_M_S) - struck_s
                return Try(safe_s, still_s, (self.running.late_ns - late_ns) * 1e-9)
            finally:
                process.kill()


@contextmanager
def rover() -> Iterator[Rover]:
    scene = Rover()
    with scene.running.running():
        yield scene


def _when(holds) -> float:
    """Return when something was first seen to hold."""
    deadline_s = time.monotonic() + 20.0
    while not holds():
        assert time.monotonic() < deadline_s, "it never came to rest"
        time.sleep(0.001)
    return time.monotonic()


def main(url: str, vx_m_s: float) -> None:
    base = RoverBase(RoverBase.Settings(url=url, connect_s=30.0), DeviceSetup("base", 0, time.monotonic_ns))
    base.open()
    for _ in until_told():
        base.command(BodyTwist(vx=vx_m_s), time.monotonic_ns() + LIFETIME_NS)
        base.drain()
    base.stop()
    signal.pause()


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
