"""The robot: a bundle of named devices.  It never knows whether a device is real, simulated, emulated or recorded."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from typing import TypeVar

from drivers.interface.commands import Command
from drivers.interface.devices import (
    Arm,
    ColourCamera,
    DepthCamera,
    Device,
    DeviceHealth,
    DeviceState,
    Imu,
    MarkerCamera,
    MobileBase,
    Operator,
    RangeScanner,
    Resettable,
    TruthSource,
)
from drivers.interface.errors import DeviceError, TrundleError
from drivers.interface.samples import OperatorEvent, ResetFaults
from drivers.interface.sensed import Sensed, Tick
from runtime.mission import MissionTracker

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Devices:
    """The devices by their names in the robot; None: it has none of that kind."""

    camera: DepthCamera | None = None
    imu: Imu | None = None
    base: MobileBase | None = None
    arm: Arm | None = None
    scan: RangeScanner | None = None
    operator: Operator | None = None
    truth: TruthSource | None = None
    markers: MarkerCamera | None = None

    def __iter__(self) -> Iterator[tuple[str, Device]]:
        """Yield the devices that are there with their names, in a fixed order."""
        for field in fields(self):
            device = getattr(self, field.name)
            if device is not None:
                yield field.name, device


class Robot:
    """Opens, reads, commands, stops and closes all devices together; what one of them does wrong, the others are spared.

    A device that raises while the loop runs is reported as faulted in the health of the same tick's `Sensed` (of the next one's
    where it failed to take a command), and the supervisor does the rest.
    """

    def __init__(self, devices: Devices, mission: MissionTracker) -> None:
        """Take the devices, still closed."""
        self.devices = devices
        self._mission = mission
        self._named = tuple(devices)
        self._colour = devices.camera if isinstance(devices.camera, ColourCamera) else None
        self._broken = {name: DeviceHealth(name, DeviceState.FAULTED) for name, _ in devices}
        self._failures: dict[str, str] = {}  # what each device has raised since the last tick

    def open(self) -> None:
        """Open every device; when one cannot be opened, those that were are closed again.

        Raises:
            DeviceError: a device cannot be opened.
        """
        try:
            for name, device in self.devices:
                try:
                    device.open()
                except Exception as error:
                    raise _device_error(name, "open", error) from error
        except BaseException:  # Ctrl-C too
            with suppress(DeviceError):
                self.close()
            raise

    def read(self, tick: Tick) -> Sensed:
        """Return all samples since the last tick; never blocks, never raises."""
        d = self.devices
        events: tuple[OperatorEvent, ...] = self._ask("operator", d.operator.drain, ()) if d.operator else ()
        if any(isinstance(event.action, ResetFaults) for event in events):
            self._clear_faults()
        return Sensed(
            tick=tick,
            depth=self._ask("camera", d.camera.latest, None) if d.camera else None,
            imu=self._ask("imu", d.imu.drain, ()) if d.imu else (),
            base=self._ask("base", d.base.drain, ()) if d.base else (),
            joints=self._ask("arm", d.arm.drain, ()) if d.arm else (),
            scans=self._ask("scan", d.scan.drain, ()) if d.scan else (),
            operator=events,
            truth=self._ask("truth", d.truth.latest, None) if d.truth else None,
            colour=self._ask("camera", self._colour.latest_colour, None) if self._colour else None,
            health=tuple(self._health(name, device) for name, device in self._named),
            mission=self._mission.fold(events),
            markers=self._ask("markers", d.markers.drain, ()) if d.markers else (),
        )

    def write(self, command: Command) -> None:
        """Send each device its part of the command; never raises."""
        base, arm, expires_ns = self.devices.base, self.devices.arm, command.expires_ns
        if base is not None and (twist := command.base) is not None:
            self._ask("base", lambda: base.command(twist, expires_ns), None)
        if arm is not None and (trajectory := command.arm) is not None:
            self._ask("arm", lambda: arm.command(trajectory, expires_ns), None)

    def stop(self) -> None:
        """Stop every device, also when one of them fails to.  Raises the first failure, a DeviceError, after all were asked."""
        self._each("stop", lambda device: device.stop())

    def close(self) -> None:
        """Close every device, also when one of them fails to.  Raises the first failure, a DeviceError, after all were asked."""
        self._each("close", lambda device: device.close())

    def _clear_faults(self) -> None:
        """Pass the operator's reset on to every device that latches faults of its own."""
        for name, device in self._named:
            if isinstance(device, Resettable):
                self._ask(name, device.clear_faults, None)

    def _ask(self, name: str, question: Callable[[], T], otherwise: T) -> T:
        try:
            return question()
        except Exception as error:  # noqa: BLE001 - one broken device must neither end the loop nor hide the others
            self._failures[name] = _sentence(error)
            return otherwise

    def _health(self, name: str, device: Device) -> DeviceHealth:
        health = self._ask(name, device.health, self._broken[name])
        failure = self._failures.pop(name, "")
        return replace(health, state=DeviceState.FAULTED, fault=failure) if failure else health

    def _each(self, verb: str, action: Callable[[Device], None]) -> None:
        failures: list[DeviceError] = []
        for name, device in self.devices:
            try:
                action(device)
            except Exception as error:  # noqa: BLE001 - one broken device must not keep the others from stopping
                failures.append(_device_error(name, verb, error))
        if failures:
            raise failures[0]


def _sentence(error: Exception) -> str:
    return str(error) if isinstance(error, TrundleError) else f"{type(error).__name__}: {error}"


def _device_error(name: str, verb: str, error: Exception) -> DeviceError:
    """Return the device's own error, or one that says whose failure it was."""
    return error if isinstance(error, DeviceError) else DeviceError(f"the {name} cannot {verb}: {_sentence(error)}")
