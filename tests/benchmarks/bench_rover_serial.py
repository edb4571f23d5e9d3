"""What the MAVLink driver costs with streams at 25 Hz: its process of a core, and its part of a tick."""

import time

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceSetup
from drivers.interface.links import Links
from drivers.rover_serial.driver import RoverBase
from drivers.rover_serial.imu import RoverImu
from tests.benchmarks.bench_omni_can import cpu_s
from tests.benchmarks.figure import Figure, of_distribution
from tests.faults.emulated import trundle, until
from tests.ports import free_port

TICKS, PERIOD_S = 400, 0.02


def figures() -> list[Figure]:
    """Drive for eight seconds in a circle; the rover's camera, which has a wire of its own, stays off."""
    url = f"tcp:127.0.0.1:{free_port()}"
    changes = ("robot.camera=null", f"robot.base.url={url}", f"robot.imu.url={url}", f"robot.truth.port={free_port()}")
    told = [word for change in ("robot=jackal_emulated", *changes) for word in ("--set", change)]
    with trundle("emulate", "square", *told) as emulation:
        try:
            until(lambda: emulation.stdout.readline().startswith("ready"), "the emulation never became ready")
            return costs(url)
        finally:
            emulation.terminate()


def costs(url: str) -> list[Figure]:
    """Return what base and inertial unit cost together."""
    links = Links()
    base = RoverBase(RoverBase.Settings(url=url), DeviceSetup("base", 0, time.monotonic_ns, links=links))
    imu = RoverImu(RoverImu.Settings(url=url), DeviceSetup("imu", 0, time.monotonic_ns, links=links))
    try:
        base.open()
        imu.open()
        run_us(base, imu, 50)
        pid = base._channel.link.pid
        before_s, began_s = cpu_s(pid), time.monotonic()
        taken_us = run_us(base, imu, TICKS)
        share = (cpu_s(pid) - before_s) / (time.monotonic() - began_s)
    finally:
        base.close()
        imu.close()
    return [
        Figure("rover_serial_process", 100.0 * share, unit="% of a core"),
        of_distribution("rover_serial_tick", taken_us, "us"),
    ]


def run_us(base: RoverBase, imu: RoverImu, ticks: int) -> list[float]:
    """Return what reading and commanding took in each tick [us]."""
    taken_us, due_s = [], time.monotonic()
    for _ in range(ticks):
        due_s += PERIOD_S
        time.sleep(max(0.0, due_s - time.monotonic()))
        before_ns = time.perf_counter_ns()
        for device in (base, imu):
            device.drain()
            device.health()
        base.command(BodyTwist(0.3, 0.0, 0.6), time.monotonic_ns() + 150_000_000)
        taken_us.append((time.perf_counter_ns() - before_ns) * 1e-3)
    return taken_us
