"""Examines a robot: opens every device, watches what it delivers, then, with permission, arms what moves."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any

from drivers.interface.devices import DeviceHealth, DeviceState, Identified
from drivers.interface.errors import DeviceError
from drivers.interface.samples import Stamp
from runtime.assembly import Assembly, assemble
from runtime.configuration import Configuration
from runtime.doctor.findings import Examination, Finding, Verdict
from runtime.doctor.machine import examine_machine
from runtime.doctor.motion import examine_motion
from runtime.doctor.stream import examine_stream, stamps_of
from runtime.outputs import LOGS
from runtime.sections import SupervisorSection

WATCHED_S = 2.0
POLL_NS = 10_000_000
HEAVIEST_BUS_LOAD = 0.5  # of the bit rate


def examine(configuration: Configuration, permitted: Callable[[str], bool]) -> Examination:
    """Examine the machine and every device.

    `permitted` is asked before real hardware is armed, with the device's name; simulated and emulated devices need none.

    Raises:
        ConfigurationError: parts do not fit together.
    """
    assembly = assemble(configuration, seed=0)
    findings = examine_machine(LOGS, configuration.loop.system)
    try:
        findings += _examine_devices(assembly, permitted)
    finally:
        with suppress(DeviceError):  # what cannot be closed has been found faulty already
            assembly.robot.close()
    made_at = datetime.now(UTC).isoformat(timespec="seconds")
    return Examination(configuration.robot.name, configuration.source, made_at, tuple(findings))


def _examine_devices(assembly: Assembly, permitted: Callable[[str], bool]) -> list[Finding]:
    findings, opened = [], []
    for name, device in assembly.robot.devices:
        try:
            device.open()
        except DeviceError as error:
            findings.append(Finding(name, "present", Verdict.FORBIDS, str(error)))
        else:
            opened.append((name, device))
    settings = assembly.configuration.supervisor
    for (name, device), stamps in zip(opened, _watch(assembly, [device for _, device in opened]), strict=True):
        health = device.health()
        findings += [_present(name, device, health), *_telling(health, settings)]
        findings += examine_stream(health, stamps, WATCHED_S, settings)
    for name, device in opened:
        if hasattr(device, "command"):
            findings += _examine_motion(assembly, name, device, permitted)
    return findings


def _watch(assembly: Assembly, devices: list[Any]) -> list[list[Stamp]]:
    """Return the stamps of what each device delivers in `WATCHED_S`."""
    clock = assembly.clock
    seen: list[list[Stamp]] = [[] for _ in devices]
    for device in devices:
        stamps_of(device)  # what has gathered while the others were opened
    until_ns = clock.now_ns() + round(WATCHED_S * 1e9)
    while clock.now_ns() < until_ns:
        clock.sleep_until(clock.now_ns() + POLL_NS)
        for device, stamps in zip(devices, seen, strict=True):
            stamps.extend(stamps_of(device))
    return seen


def _present(name: str, device: Any, health: DeviceHealth) -> Finding:
    if health.state in (DeviceState.OPEN, DeviceState.ENDED) and not health.fault:
        who = device.identity() if isinstance(device, Identified) else None
        parts = (who.model, who.protocol, who.firmware and f"firmware {who.firmware}", who.serial) if who else ()
        return Finding(name, "present", Verdict.GOOD, ", ".join(part for part in parts if part) or type(device).__name__)
    return Finding(name, "present", Verdict.FORBIDS, health.fault or f"it is {health.state.value}")


def _telling(health: DeviceHealth, settings: SupervisorSection) -> list[Finding]:
    """Return what the device says of its battery and its wire."""
    found, fraction, volts, load = [], health.battery_fraction, health.battery_v, health.bus_load
    if fraction is not None or volts is not None:
        low = fraction is not None and fraction < settings.lowest_battery_fraction
        told = [f"{100 * fraction:.0f} %"] if fraction is not None else []
        told += [f"{volts:.1f} V"] if volts is not None else []
        found.append(Finding(health.device, "battery", Verdict.FORBIDS if low else Verdict.GOOD, ", ".join(told)))
    if load is not None:
        verdict = Verdict.WARNING if load > HEAVIEST_BUS_LOAD else Verdict.GOOD
        found.append(Finding(health.device, "bus load", verdict, f"{100 * load:.0f} % of the bit rate"))
    return found


def _examine_motion(assembly: Assembly, name: str, device: Any, permitted: Callable[[str], bool]) -> list[Finding]:
    if getattr(device, "plays_recording", False):
        return []
    real_time = getattr(device, "real_time", False)
    hardware = real_time and assembly.configuration.emulation is None
    if hardware and not permitted(name):
        return [Finding(name, "watchdog", Verdict.WARNING, "not tested: arming it was not permitted")]
    return examine_motion(name, device, assembly.clock, real_time=real_time)
