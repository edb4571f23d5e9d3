"""What a real driver is tested against: its device, emulated, in a world that goes by in real time beside the test.

A driver that has firmware needs no more than an entry in `RIGS`: its settings, with ports of its own, and its firmware's.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from runtime.emulate import CATCH_UP_NS, FreeRun
from runtime.registry import Part, load
from sim_drivers.firmware.firmware import FirmwareSetup
from sim_drivers.world import MujocoWorld
from tests.faults.emulated import GROUP
from tests.ports import free_port
from tests.sim_drivers.firmware.fcibench import free_host


@dataclass(frozen=True)
class Rig:
    """Settings of both ends of a wire."""

    driver: dict[str, Any]
    firmware: dict[str, Any] = field(default_factory=dict)
    hasty: dict[str, Any] = field(default_factory=dict)  # settings of a driver that soon gives a missing device up
    served_by: str = ""  # the driver whose firmware serves this one too, on the same wire


def omni_can() -> Rig:
    bus = {"interface": "udp_multicast", "channel": GROUP, "port": free_port()}
    settings = {"bus": bus, "verify_watchdog": False, "connect_s": 20.0, "watchdog_s": 2.0}
    return Rig(settings, {"boot_s": 0.0, "axis": {"watchdog_s": 2.0}}, hasty={"connect_s": 0.3})


def rover_serial() -> Rig:
    settings = {"url": f"tcp:127.0.0.1:{free_port()}", "connect_s": 20.0}
    return Rig(settings, {"boot_s": 0.0, "estimate_s": 0.0}, hasty={"connect_s": 0.6})


def rover_imu() -> Rig:
    return Rig({"url": f"tcp:127.0.0.1:{free_port()}"}, {"boot_s": 0.0, "estimate_s": 0.0}, served_by="rover_serial")


def emulated_truth() -> Rig:
    return Rig({"port": free_port()}, hasty={"open_timeout_s": 0.3})


def realsense() -> Rig:
    return Rig({"source": "emulated", "memory": f"contract-{free_port()}"}, hasty={"connect_s": 0.3})


def franka() -> Rig:
    return Rig({"host": free_host(), "open_timeout_s": 20.0}, hasty={"open_timeout_s": 5.0})


RIGS: dict[str, Callable[[], Rig]] = {  # by the driver's name
    "omni_can": omni_can,
    "rover_serial": rover_serial,
    "rover_imu": rover_imu,
    "franka": franka,
    "emulated_truth": emulated_truth,
    "realsense": realsense,
    "realsense_imu": realsense,
}


class FreeRunning:
    """A world and its firmware in real time, in a thread."""

    def __init__(self, driver: str, driver_settings: object, rig: Rig, world: MujocoWorld, seed: int) -> None:
        """Join the world, which is compiled later."""
        cls = load(Part.FIRMWARE, rig.served_by or driver)
        if rig.served_by:
            driver_settings = load(Part.DRIVER, rig.served_by).Settings(**rig.driver)
        self._run = FreeRun(world)
        self._firmware = cls(driver_settings, cls.Settings(**rig.firmware), FirmwareSetup("tested", seed, world, self._run))
        self._run.catch_up_ns = getattr(self._firmware, "catch_up_ns", CATCH_UP_NS)
        self._over = threading.Event()

    @property
    def late_ns(self) -> int:
        """For how long the world has stood still, the machine being too slow."""
        return self._run.late_ns

    @contextmanager
    def running(self) -> Iterator[None]:
        """Within the block the wire is bound and time passes."""
        self._firmware.open()
        self._thread = threading.Thread(target=self._step)
        self._thread.start()
        try:
            yield
        finally:
            self.vanish()

    def vanish(self) -> None:
        """Be gone."""
        self._over.set()
        self._thread.join()
        self._firmware.close()

    def _step(self) -> None:
        self._run.start()
        while not self._over.is_set():
            self._run.step()
