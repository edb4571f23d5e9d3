"""Every registered driver in a world with something to see, whatever kind of device it is."""

import math
import os
import pty
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import mujoco
import numpy as np
import pytest

from drivers.interface.commands import BodyTwist, JointTrajectory
from drivers.interface.devices import (
    Arm,
    DepthCamera,
    DeviceSetup,
    Imu,
    MarkerCamera,
    MobileBase,
    Operator,
    RangeScanner,
    TruthSource,
)
from drivers.interface.errors import DeviceError, TrundleError
from drivers.interface.samples import (
    DepthFrame,
    ImuSample,
    JointSample,
    MarkerSample,
    OperatorEvent,
    PoseSample,
    RangeScan,
    TruthSample,
    WheelSample,
)
from runtime.registry import Part, load
from sim_drivers.world import MujocoWorld
from tests.contract.rigs import RIGS, FreeRunning
from tests.contract.streams import build_world, device_of

DATA = Path(__file__).parents[1] / "data"
# What a driver needs beyond its defaults.
SETTINGS: dict[str, dict[str, Any]] = {
    "recorded_depth": {
        "path": DATA / "realsense_depth", "rate_hz": 30.0, "fx_px": 390.0, "fy_px": 390.0, "cx_px": 320.0, "cy_px": 240.0,
        "loop": True,
    },
    "recorded_wheels": {"path": DATA / "diff_drive" / "input_excerpt.txt"},
}  # fmt: skip
ROLE = {
    DepthFrame: DepthCamera,
    MarkerSample: MarkerCamera,
    ImuSample: Imu,
    RangeScan: RangeScanner,
    WheelSample: MobileBase,
    PoseSample: MobileBase,
    JointSample: Arm,
    OperatorEvent: Operator,
    TruthSample: TruthSource,
}


@dataclass
class Bench:
    """One device under test and its world."""

    device: Any
    world: MujocoWorld
    elsewhere: FreeRunning | None = None  # the world goes by in real time, and the device is at the other end of a wire
    clock_fails: bool = False

    @property
    def free_running(self) -> bool:
        return self.elsewhere is not None

    def now_ns(self) -> int:
        if self.clock_fails:
            raise DeviceError("the clock has failed")
        return time.monotonic_ns() if self.free_running else self.world.now_ns

    @property
    def is_base(self) -> bool:
        return hasattr(type(self.device), "kinematics")  # a look at the instance would read a recording

    @property
    def is_in_world(self) -> bool:
        """Whether what it does can be seen in the world (a recording drove elsewhere)."""
        return hasattr(self.device, "act") or self.free_running

    def open(self) -> None:
        """Open it; hardware that is not there ends the test."""
        try:
            self.device.open()
        except DeviceError as error:
            if self.free_running or not getattr(self.device, "real_time", False):
                raise
            pytest.skip(str(error))

    def fail(self) -> None:
        """Let it meet an error: its device vanishes, or its clock."""
        if self.elsewhere is None:
            self.clock_fails = True
            with suppress(TrundleError):
                self.read()
            self.clock_fails = False
        else:
            self.elsewhere.vanish()
            self.wait(0.6)

    def wait(self, seconds: float) -> None:
        if self.free_running:
            time.sleep(seconds)
        else:
            self.world.step_to(self.world.now_ns + round(seconds * 1e9))

    def read(self) -> tuple[Any, ...]:
        """Return what it delivers now."""
        if hasattr(self.device, "drain") and not isinstance(self.device, TruthSource):
            return self.device.drain()
        sample = self.device.latest()
        return () if sample is None else (sample,)

    def order(self, value: float = 0.3) -> BodyTwist | JointTrajectory:
        """Return something to do: drive forwards [m/s], or turn the first joint from where the arm is [rad]."""
        if self.is_base:
            return BodyTwist(value, 0.0, 0.0)
        self.wait(0.02)
        start = self.read()[-1].position_rad
        knots = np.stack((start, start + value * np.eye(len(start))[0]))
        return JointTrajectory(self.now_ns(), np.array([0.0, 1.0]), knots, np.zeros_like(knots))

    def command(self, order: BodyTwist | JointTrajectory, lifetime_s: float) -> None:
        self.device.command(order, self.now_ns() + round(lifetime_s * 1e9))

    def run(self, seconds: float) -> list[Any]:
        """Let time pass in ticks, keep it moving where it moves, and return all that it delivers."""
        samples, order = [], self.order() if hasattr(self.device, "command") else None
        for _ in range(round(seconds / 0.05)):
            if order is not None:
                self.command(order, lifetime_s=0.1)
            self.wait(0.05)
            samples += self.read()
        return samples

    def displacement(self, seconds: float) -> float:
        """Return how far anything but a base's wheels goes in so much time [m or rad].

        Motors that hold against each other, as after braking, creep by the softness of the contacts: a milliradian of a wheel
        in half a second, and a twentieth of a millimetre on the floor, where it counts.
        """
        model = self.world.model
        hinges = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE)
        wheels = [model.jnt_qposadr[joint] for joint in hinges] if self.is_base else []
        before = np.delete(self.world.data.qpos, wheels)
        self.wait(seconds)
        return float(np.abs(np.delete(self.world.data.qpos, wheels) - before).max(initial=0.0))


@contextmanager
def bench(driver: str, seed: int = 5, *, missing: bool = False, **settings: Any) -> Iterator[Bench]:
    """Build a device with a pseudo-terminal as standard input; what does not move rides on a base that drives a curve.

    A real driver whose device can be emulated has it at the other end of the wire, unless it is `missing`, and the world goes by
    in real time.
    """
    cls, world, rig = load(Part.DRIVER, driver), build_world(), RIGS[driver]() if driver in RIGS else None
    own = {} if rig is None else rig.driver | (rig.hasty if missing else {})
    chosen = cls.Settings(**(SETTINGS.get(driver, {}) | own | settings))
    elsewhere = None if rig is None or missing else FreeRunning(driver, chosen, rig, world, seed)
    tested = Bench(None, world, elsewhere)
    tested.device = cls(chosen, DeviceSetup("tested", seed, tested.now_ns, None if rig else world))
    served = rig is not None and rig.served_by  # it rides on what serves it
    carrier = None if tested.is_base or served else device_of("sim_omni", world, "carrier")
    world.compile()
    if carrier is not None and not hasattr(cls, "command"):
        carrier.open()
        carrier.command(BodyTwist(0.2, 0.1, math.pi / 10), 10**18)
    with terminal(), nullcontext() if elsewhere is None else elsewhere.running():
        try:
            yield tested
        finally:
            tested.clock_fails = False
            tested.device.close()


@contextmanager
def terminal() -> Iterator[None]:
    """Put a pseudo-terminal in the place of standard input."""
    master, slave = pty.openpty()
    with os.fdopen(master, "wb", buffering=0), os.fdopen(slave, "rb", buffering=0) as stdin, patch.object(sys, "stdin", stdin):
        yield
