"""The omni base on a CAN bus, as the loop sees it."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.devices import DeviceHealth, DeviceIdentity, DeviceSetup
from drivers.interface.errors import DeviceError
from drivers.interface.kinematics import OmniThreeWheel
from drivers.interface.samples import Stamp, WheelSample, frozen_array
from drivers.interface.settings import Settings
from drivers.io.channels import MemorySpec, RingSpec
from drivers.io.host_clock import HostClock
from drivers.io.process import IoProcess, IoSpec
from drivers.omni_can.axes import SAMPLE, SessionSettings
from drivers.omni_can.can_wire import BusChoice
from drivers.omni_can.codec import Codec
from drivers.omni_can.dbc import load_codec
from drivers.omni_can.settings import TURN_RAD, OmniCanSettings

MEMORY = MemorySpec((RingSpec("wheels", SAMPLE, 512),), (), command_values=3)


class OmniCanBase:
    """Three ODrive axes on a CAN bus behind the contract of a mobile base; the bus is a process of its own."""

    Settings: ClassVar[type[Settings]] = OmniCanSettings
    role: ClassVar[str] = "base"
    real_time: ClassVar[bool] = True

    def __init__(self, settings: OmniCanSettings, setup: DeviceSetup) -> None:
        """Compile the messages; nothing is touched.

        Raises:
            ConfigurationError: the DBC file cannot be used.
        """
        self._settings = settings
        self._setup = setup
        self._limits, self._kinematics = settings.limits, settings.nominal
        self._motor_from_wheel = np.array(settings.signs, dtype=np.float64) * settings.gear_ratio / TURN_RAD  # (3,)
        self._clock = HostClock(setup.now_ns)
        self._io = IoProcess(
            IoSpec(setup.name, "drivers.omni_can.session:OmniCanSession", session_settings(settings, setup.name), MEMORY)
        )

    @property
    def limits(self) -> BaseLimits:
        """What it may be asked."""
        return self._limits

    @property
    def kinematics(self) -> OmniThreeWheel:
        """The nominal geometry."""
        return self._kinematics

    def open(self) -> None:
        """Join the bus, find the axes and see their watchdogs trip; nothing moves, and nothing is armed afterwards.

        Raises:
            DeviceError: no bus, an axis that does not answer, or one without a watchdog.
        """
        self._setup.now_ns()
        self._io.open()

    def command(self, twist: BodyTwist, expires_ns: int) -> None:
        """Follow the twist until `expires_ns`, then brake.  The first one after `open` or a reset arms the axes.

        Raises:
            DeviceError: it is not finite, or the base is not open.
        """
        if not twist.finite:
            raise DeviceError(f"{self._setup.name}: the twist {twist} is not finite")
        self._io.command(self._kinematics.wheel_rates(twist) * self._motor_from_wheel, self._clock.to_host(expires_ns))

    def drain(self) -> tuple[WheelSample, ...]:
        """Return the wheel samples that have arrived since the last call, oldest first."""
        if not self._io.is_open:
            return ()
        records = self._io.ring("wheels").drain()
        if not len(records):
            return ()
        offset_ns = self._clock.offset_ns()
        captured_ns, received_ns = ((records[name] + offset_ns).tolist() for name in ("captured_ns", "received_ns"))
        stamps = map(Stamp, captured_ns, received_ns, records["sequence"].tolist())
        position, velocity = (frozen_array(records[name] / self._motor_from_wheel) for name in ("turns", "turns_s"))  # (n, 3)
        return tuple(map(WheelSample, stamps, position, velocity))

    def stop(self) -> None:
        """Brake to rest."""
        self._io.stop()

    def close(self) -> None:
        """Brake to rest, disarm, and leave the bus."""
        self._io.close()

    def clear_faults(self) -> None:
        """Let the next command clear the axes' errors and arm them."""
        self._io.clear_faults()

    def health(self) -> DeviceHealth:
        """Say how it stands."""
        record = self._io.health()
        return DeviceHealth(
            device=self._setup.name,
            state=record.state,
            fault=record.fault,
            received=self._io.ring("wheels").written,
            dropped=record.dropped,
            overflowed=self._io.ring("wheels").overflowed,
            expired_commands=record.expired_commands,
            expected_period_ns=self._settings.encoder_ms * 1_000_000,
            battery_fraction=_known(record.battery_fraction),
            battery_v=_known(record.battery_v),
            bus_load=_known(record.bus_load),
        )

    def identity(self) -> DeviceIdentity:
        """Return firmware and protocol, once the axes have been heard."""
        record = self._io.health()
        return DeviceIdentity(self._setup.name, "ODrive, three axes", record.firmware, record.protocol)


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


def session_settings(settings: OmniCanSettings, name: str) -> SessionSettings:
    """Return what the process on the bus is told.

    Raises:
        ConfigurationError: the DBC file cannot be used.
    """
    firmwares = ("0.5", "0.6") if settings.firmware == "auto" else (settings.firmware,)
    codecs: dict[str, Codec] = {firmware: load_codec(firmware, settings.dbc) for firmware in firmwares}
    return SessionSettings(
        bus=BusChoice(name, settings.place, settings.bus_arguments),
        hears_itself=settings.bus.hears_itself,
        bit_rate=settings.bus.bit_rate,
        codecs=codecs,
        node_ids=settings.node_ids,
        input_mode=settings.input_mode,
        watchdog_s=settings.watchdog_s,
        verify_watchdog=settings.verify_watchdog,
        heartbeat_s=settings.heartbeat_ms * 1e-3,
        encoder_s=settings.encoder_ms * 1e-3,
        latency_s=settings.latency_s,
        connect_s=settings.connect_s,
        silent_s=settings.silent_s,
        brake_s=settings.brake_s,
        gather_s=settings.gather_s,
        fastest_turns_s=settings.fastest_turns_s,
        battery_empty_v=settings.battery_empty_v,
        battery_full_v=settings.battery_full_v,
    )
