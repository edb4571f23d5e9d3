"""What the CAN driver costs at a robot's real rates: its process of a core, and its part of a tick, over a bus on loopback."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import drivers.omni_can
from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceHealth, DeviceSetup, DeviceState
from drivers.interface.kinematics import OmniThreeWheel
from drivers.interface.samples import Stamp, WheelSample, frozen_array
from drivers.omni_can.axes import SAMPLE
from drivers.omni_can.driver import OmniCanBase
from drivers.omni_can.settings import OmniCanSettings
from tests.benchmarks.figure import Figure, of_distribution

TICKS = 200
PERIOD_S = 0.02
DBC = str(Path(drivers.omni_can.__file__).with_name("cansimple_0_6.dbc"))
BUS = {"interface": "udp_multicast", "channel": "239.74.163.2", "port": 45731}

# Three axes in closed loop, out of step: encoders at 100 Hz, heartbeat and bus voltage at 10, temperature at 1.
AXES = """
import sys, time
import can
bus = can.Bus(interface="udp_multicast", channel=sys.argv[1], port=int(sys.argv[2]), hop_limit=0, fd=False)
closed_loop, volts = bytes([0, 0, 0, 0, 8, 0, 0, 0]), bytes([0, 0, 192, 65, 0, 0, 0, 0])
kinds = ((9, 10, bytes(8)), (1, 100, closed_loop), (23, 100, volts), (21, 1000, bytes(8)))
begin_s = time.monotonic()
for step in range(30_000):
    time.sleep(max(0.0, begin_s + step * 1e-3 - time.monotonic()))
    for node in range(3):
        for command, period_ms, data in kinds:
            if (step + 3 * node) % period_ms == 0:
                bus.send(can.Message(arbitration_id=node << 5 | command, data=data, is_extended_id=False))
"""


# The peer: the same frames through python-can and cantools as their documentation shows it, without sending anything.
PEER = """
import sys
import can, cantools
database = cantools.database.load_file(sys.argv[3])
bus = can.Bus(interface="udp_multicast", channel=sys.argv[1], port=int(sys.argv[2]), hop_limit=0, fd=False)
known = {message.frame_id for message in database.messages}
for message in bus:
    if message.arbitration_id & 31 in known and message.dlc == 8:
        database.decode_message(message.arbitration_id & 31, message.data)
"""


def figures() -> list[Figure]:
    """Drive for eight seconds and look at both sides."""
    where = (str(BUS["channel"]), str(BUS["port"]))
    axes, peer = (subprocess.Popen([sys.executable, "-c", code, *where, DBC]) for code in (AXES, PEER))
    settings = OmniCanSettings(bus=BUS, firmware="0.6", verify_watchdog=False, connect_s=20.0)
    base = OmniCanBase(settings, DeviceSetup("base", 0, time.monotonic_ns))
    try:
        base.open()
        run_us(base, 50)
        before_s, began_s = (cpu_s(base._io.pid), cpu_s(peer.pid)), time.monotonic()
        taken_us, plain_us = run_us(base, TICKS)
        elapsed_s = time.monotonic() - began_s
        ours, theirs = (cpu_s(pid) - before for pid, before in zip((base._io.pid, peer.pid), before_s, strict=True))
    finally:
        base.close()
        for process in (axes, peer):
            process.kill()
            process.wait()
    share, peer_share = 100.0 * ours / elapsed_s, 100.0 * theirs / elapsed_s
    return [
        Figure(
            "omni_can_process", share, unit="% of a core", peer="python-can and cantools, receiving only", peer_value=peer_share
        ),
        of_distribution("omni_can_tick", taken_us, "us", "the same samples, health and rates without a driver", plain_us),
    ]


def run_us(base: OmniCanBase, ticks: int) -> tuple[list[float], list[float]]:
    """Return what reading and commanding took [us], and the peer: every other tick begins with one of them, cold from sleep."""
    taken_us: tuple[list[float], list[float]] = ([], [])
    records, due_s = np.zeros(2, SAMPLE), time.monotonic()
    for tick in range(2 * ticks):
        due_s += PERIOD_S
        time.sleep(max(0.0, due_s - time.monotonic()))
        before_ns = time.perf_counter_ns()
        if tick % 2:
            plain(records, base.kinematics)
            taken_us[1].append((time.perf_counter_ns() - before_ns) * 1e-3)
        drive(base)
        if not tick % 2:
            taken_us[0].append((time.perf_counter_ns() - before_ns) * 1e-3)
    return taken_us


def drive(base: OmniCanBase) -> None:
    """Do what a tick asks of the driver."""
    base.drain()
    base.health()
    base.command(BodyTwist(0.2, 0.0, 0.1), time.monotonic_ns() + 150_000_000)


def plain(records: np.ndarray, kinematics: OmniThreeWheel) -> None:
    """Make the same objects from arrays that are there: what of a tick's time is Python's, woken from sleep."""
    stamps = map(Stamp, *((records[name] + 1).tolist() for name in ("captured_ns", "received_ns", "sequence")))
    position, velocity = (frozen_array(records[name] / 2.0) for name in ("turns", "turns_s"))
    tuple(map(WheelSample, stamps, position, velocity))
    DeviceHealth("base", DeviceState.OPEN, received=len(records), battery_v=24.0)
    kinematics.wheel_rates(BodyTwist(0.2, 0.0, 0.1)) * 0.5


def cpu_s(pid: int | None) -> float:
    """Return the processor time that a process has used [s], to the nanosecond."""
    with open(f"/proc/{pid}/schedstat") as file:
        return int(file.read().split()[0]) * 1e-9
