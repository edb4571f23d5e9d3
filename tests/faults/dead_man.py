"""One try of the dead man: a base is driven, its driver's process is ended or stopped, and the wire is listened to."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass

import can

from tests.faults.emulated import ROOT, EmulatedRobot, Watcher, children, until

SET_INPUT_VEL, HEARTBEAT = 0x0D, 0x01
IDLE = 1
DRIVING_M_S, STANDING_M_S = 0.25, 0.005


@dataclass(frozen=True)
class Try:
    """What followed, in seconds after the blow."""

    safe_s: float  # until zero or a disarm was on the wire for every axis
    still_s: float  # until the base stood


def attempt(robot: EmulatedRobot, watcher: Watcher, blow: str, vx_m_s: float) -> Try:
    """Drive, strike, listen.  `blow`: kill or stop the runtime, or kill_io, the process at the wire."""
    arguments = [sys.executable, "-m", "tests.faults.commander", str(robot.can_port), str(vx_m_s)]
    with subprocess.Popen(arguments, cwd=ROOT) as process, robot.bus() as bus:
        try:
            until(lambda: watcher.speed_m_s > DRIVING_M_S, "it never drove")
            (io,) = children(process.pid)
            while bus.recv(0.0) is not None:
                pass
            struck_s = time.time()  # the bus stamps with the wall clock
            struck_ns = time.monotonic_ns()
            number = signal.SIGSTOP if blow == "stop" else signal.SIGKILL
            os.kill(io if blow == "kill_io" else process.pid, number)
            if blow == "kill_io":  # whoever starts another process at the wire would come back
                os.kill(process.pid, signal.SIGSTOP)
            safe_s = _safe(bus) - struck_s
            until(lambda: watcher.speed_m_s < STANDING_M_S, "it never stood")
            return Try(safe_s, (watcher.newest.stamp.captured_ns - struck_ns) * 1e-9)
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
