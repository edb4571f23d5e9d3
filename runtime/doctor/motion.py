"""What can only be known by arming: does it jump at the first command, and who stops it when commands cease."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivers.interface.clock import Clock
from drivers.interface.commands import BodyTwist, JointTrajectory
from drivers.interface.devices import DeviceState, Resettable
from drivers.interface.errors import TrundleError
from drivers.interface.samples import JointSample, PoseSample, WheelSample
from runtime.doctor.findings import Finding, Verdict

TICK_NS = 20_000_000
COMMAND_NS = 100_000_000  # how long each command is valid
SETTLED_S, COMMANDED_S, PATIENCE_S, RECOVERY_S = 0.1, 0.5, 3.0, 3.0
JUMP_RAD, JUMP_M = 0.05, 0.01  # what a device that is told to stand still may turn or go


@dataclass(slots=True)
class _Travel:
    """How far something has gone from where it was first seen."""

    first: Any = None
    largest: float = 0.0
    unit: str = "rad"
    limit: float = JUMP_RAD
    samples: int = 0

    def add_all(self, samples: Sequence[Any]) -> None:
        for sample in samples:
            self._add(sample)

    def _add(self, sample: Any) -> None:
        if isinstance(sample, WheelSample | JointSample):
            place = np.asarray(sample.position_rad)
        elif isinstance(sample, PoseSample):
            place = np.array([sample.local_from_base.x, sample.local_from_base.y])
            self.unit, self.limit = "m", JUMP_M
        else:
            return
        self.first = place if self.first is None else self.first
        self.largest = max(self.largest, float(np.abs(place - self.first).max()))
        self.samples += 1


def examine_motion(name: str, device: Any, clock: Clock, *, real_time: bool) -> list[Finding]:
    """Tell a device to stand still, then nothing more; the operator has given permission.

    Its dead man, or its own watchdog, must act; a real or emulated device's own should too, as it is the second line.
    """
    try:
        travel = _command_rest(device, clock)
        jump = _jump(name, travel)
        return [jump, _watchdog(name, device, clock, real_time=real_time)]
    except TrundleError as error:
        return [Finding(name, "first command", Verdict.FORBIDS, str(error))]


def _rest_of(device: Any) -> BodyTwist | JointTrajectory:
    return BodyTwist() if hasattr(device, "kinematics") else JointTrajectory.rest()


def _command_rest(device: Any, clock: Clock) -> _Travel:
    travel = _Travel()
    until_ns = clock.now_ns() + round(SETTLED_S * 1e9)
    while clock.now_ns() < until_ns:  # where it stands before it is armed
        clock.sleep_until(clock.now_ns() + TICK_NS)
        travel.add_all(device.drain()[-1:])
    for _ in range(round(COMMANDED_S * 1e9 / TICK_NS)):
        device.command(_rest_of(device), clock.now_ns() + COMMAND_NS)
        clock.sleep_until(clock.now_ns() + TICK_NS)
        travel.add_all(device.drain())
    return travel


def _jump(name: str, travel: _Travel) -> Finding:
    if not travel.samples:
        return Finding(name, "first command", Verdict.FORBIDS, "it was told to stand still and reports no motion or rest")
    verdict = Verdict.FORBIDS if travel.largest > travel.limit else Verdict.GOOD
    return Finding(name, "first command", verdict, f"moved {travel.largest:.4f} {travel.unit} when told to stand still")


def _watchdog(name: str, device: Any, clock: Clock, *, real_time: bool) -> Finding:
    """Wait for what stops it: the driver's dead man counts an expired command, the device itself says that it has faulted."""
    expired, began_ns = device.health().expired_commands, clock.now_ns()
    dead_man_s: float | None = None
    while (waited_s := (clock.now_ns() - began_ns) * 1e-9) < (PATIENCE_S if real_time or dead_man_s is None else 0.0):
        health = device.health()
        if dead_man_s is None and health.expired_commands > expired:
            dead_man_s = waited_s
        if health.state is DeviceState.FAULTED:
            recovered = _recovered(device, clock)
            told = f"tripped {waited_s:.2f} s after the last command ({health.fault}); "
            told += "cleared again" if recovered else "its fault could not be cleared"
            return Finding(name, "watchdog", Verdict.GOOD if recovered else Verdict.FORBIDS, told)
        device.drain()
        clock.sleep_until(clock.now_ns() + TICK_NS)
    if dead_man_s is None:
        return Finding(name, "watchdog", Verdict.FORBIDS, f"nothing stopped it within {PATIENCE_S:g} s of the last command")
    told = f"the driver's dead man acted {dead_man_s:.2f} s after the last command"
    if not real_time:
        return Finding(name, "watchdog", Verdict.GOOD, told)
    return Finding(name, "watchdog", Verdict.WARNING, f"{told}; the device's own watchdog was not seen to trip")


def _recovered(device: Any, clock: Clock) -> bool:
    if isinstance(device, Resettable):
        device.clear_faults()
    began_ns = clock.now_ns()
    while clock.now_ns() - began_ns < RECOVERY_S * 1e9:
        if device.health().state is DeviceState.OPEN:
            return True
        device.drain()
        clock.sleep_until(clock.now_ns() + TICK_NS)
    return False
