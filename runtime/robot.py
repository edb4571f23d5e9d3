"""The robot: a bundle of named devices.  It never knows whether a device is real, simulated, emulated or recorded."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, fields

from drivers.interface.commands import Command
from drivers.interface.devices import (
    Arm,
    DepthCamera,
    Device,
    Imu,
    MobileBase,
    Operator,
    RangeScanner,
    TruthSource,
)
from drivers.interface.errors import TrundleError
from drivers.interface.sensed import Sensed, Tick
from runtime.mission import MissionTracker


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

    def __iter__(self) -> Iterator[Device]:
        """Yield the devices that are there, in a fixed order."""
        for field in fields(self):
            device = getattr(self, field.name)
            if device is not None:
                yield device


class Robot:
    """Opens, reads, commands, stops and closes all devices together."""

    def __init__(self, devices: Devices, mission: MissionTracker) -> None:
        """Take the devices, still closed."""
        self.devices = devices
        self._mission = mission

    def open(self) -> None:
        """Open every device; when one cannot be opened, those that were are closed again.

        Raises:
            DeviceError: a device cannot be opened.
        """
        try:
            for device in self.devices:
                device.open()
        except BaseException:
            with suppress(TrundleError):
                self.close()
            raise

    def read(self, tick: Tick) -> Sensed:
        """Return all samples since the last tick; never blocks."""
        d = self.devices
        events = d.operator.drain() if d.operator else ()
        return Sensed(
            tick=tick,
            depth=d.camera.latest() if d.camera else None,
            imu=d.imu.drain() if d.imu else (),
            base=d.base.drain() if d.base else (),
            joints=d.arm.drain() if d.arm else (),
            scans=d.scan.drain() if d.scan else (),
            operator=events,
            truth=d.truth.latest() if d.truth else None,
            health=tuple(device.health() for device in d),
            mission=self._mission.fold(events),
        )

    def write(self, command: Command) -> None:
        """Send each device its part of the command."""
        if self.devices.base is not None and command.base is not None:
            self.devices.base.command(command.base, command.expires_ns)
        if self.devices.arm is not None and command.arm is not None:
            self.devices.arm.command(command.arm, command.expires_ns)

    def stop(self) -> None:
        """Stop every device, also when one of them fails to.  Raises the first failure after all were asked."""
        self._each(lambda device: device.stop())

    def close(self) -> None:
        """Close every device, also when one of them fails to.  Raises the first failure after all were asked."""
        self._each(lambda device: device.close())

    def _each(self, action: Callable[[Device], None]) -> None:
        failures: list[Exception] = []
        for device in self.devices:
            try:
                action(device)
            except Exception as error:  # noqa: BLE001 - one broken device must not keep the others from stopping
                failures.append(error)
        if failures:
            raise failures[0]
