"""One try of the dead man: a base is driven, its driver's process is ended or stopped, and the wire is listened to."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass

import can

from tests.faults.emulated import ROOT, EmulatedRobot, Watcher, children, until

SET_INPUT_VEL, SET_AXIS_STATE, HEARTBEAT = 0x0D, 0x07, 0x01
IDLE = 1
FULL_M_S, STANDING_M_S = 0.7, 0.005
DRIVING = 0.9  # of the speed that was asked for: then it is struck


def strike(runtime: int, io: int, blow: str) -> None:
    """Kill or stop a runtime, kill its process at the wire (kill_io), or ask for an ordinary stop (ask)."""
    os.kill(io if blow == "kill_io" else runtime, {"stop": signal.SIGSTOP, "ask": signal.SIGUSR1}.get(blow, signal.SIGKILL))
    if blow == "kill_io":  # whoever starts another process at the wire would come back
        os.kill(runtime, signal.SIGSTOP)


@dataclass(frozen=True)
class Try:
    """What followed, in seconds after the blow."""

    safe_s: float  # until zero or a disarm was on the wire, and the robot began to brake
    still_s: float  # until it stood
    world_late_s: float  # for how long its world stood still in between, its machine being too slow

    @property
    def stopping_s(self) -> float:
        """From the one to the other, in the world's own time."""
        return self.still_s - self.safe_s - self.world_late_s


def attempt(robot: EmulatedRobot, watcher: Watcher, blow: str, vx_m_s: float) -> Try:
    """Drive, strike, listen.  The axes' own stopping is seen by the blow `coast`, which disarms them."""
    arguments = [sys.executable, "-m", "tests.faults.commander", str(robot.can_port), str(vx_m_s)]
    with subprocess.Popen(arguments, cwd=ROOT) as process, robot.bus() as bus:
        try:
            until(lambda: watcher.speed_m_s > DRIVING * abs(vx_m_s), "it never drove")
            (io,) = children(process.pid)
            while bus.recv(0.0) is not None:
                pass
            struck_s = time.time()  # the bus stamps with the wall clock
            struck_ns = time.monotonic_ns()
            if blow == "coast":
                for node in range(3):
                    bus.send(can.Message(arbitration_id=node << 5 | SET_AXIS_STATE, data=(IDLE, 0, 0, 0), is_extended_id=False))
            else:
                strike(process.pid, io, blow)
            safe_s, late_ns = _safe(bus) - struck_s, watcher.late_ns
            until(lambda: watcher.speed_m_s < STANDING_M_S, "it never stood")
            still_s = (watcher.newest.stamp.captured_ns - struck_ns) * 1e-9
            return Try(safe_s, still_s, (watcher.late_ns - late_ns) * 1e-9)
        finally:
            process.kill()


def _safe(bus: can.BusABC) -> float:
    """Return when every axis has been told zero, or has said that it is idle; a later order to move would be a failure."""
    safe: dict[int, float] = {}
    deadline_s = time.monotonic() + 20.0
    while len(safe) < 3:
        message = bus.recv(0.5)
        assert time.monotonic() < deadline_s, "no zero and no disarm came"
        if message is None:
            continue
        node, command = message.arbitration_id >> 5, message.arbitration_id & 0x1F
        if command == SET_INPUT_VEL and len(message.data) == 8:
            if message.data[:4] in (b"\0\0\0\0", b"\0\0\0\x80"):
                safe.setdefault(node, message.timestamp)
            else:
                safe.pop(node, None)
        elif command == HEARTBEAT and len(message.data) == 8 and message.data[4] == IDLE:
            safe.setdefault(node, message.timestamp)
    return max(safe.values())
