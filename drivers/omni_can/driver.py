"""The omni base on a CAN bus, as the loop sees it."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.devices import DeviceSetup
from drivers.interface.errors import DeviceError
from drivers.interface.kinematics import OmniThreeWheel
from drivers.interface.samples import WheelSample, frozen_array
from drivers.interface.settings import Settings
from drivers.io.channels import MemorySpec, RingSpec
from drivers.io.device import WireDevice
from drivers.io.process import IoSpec
from drivers.omni_can.axes import SAMPLE, SessionSettings
from drivers.omni_can.can_wire import BusChoice
from drivers.omni_can.codec import Codec
from drivers.omni_can.dbc import load_codec
from drivers.omni_can.settings import TURN_RAD, OmniCanSettings

MEMORY = MemorySpec((RingSpec("wheels", SAMPLE, 512),), (), command_values=3)


class OmniCanBase(WireDevice):
    """Three ODrive axes on a CAN bus behind the contract of a mobile base; the bus is a process of its own.

    `open` sees the axes' watchdogs trip and arms nothing; the first command after it, or after a reset, clears their errors and
    arms them.  `close` disarms them.
    """

    Settings: ClassVar[type[Settings]] = OmniCanSettings
    role: ClassVar[str] = "base"
    what: ClassVar[str] = "ODrive, three axes"

    def __init__(self, settings: OmniCanSettings, setup: DeviceSetup) -> None:
        """Compile the messages; nothing is touched.

        Raises:
            ConfigurationError: the DBC file cannot be used.
        """
        process = session_settings(settings, setup.name)
        spec = IoSpec(setup.name, "drivers.omni_can.session:OmniCanSession", process, MEMORY)
        super().__init__(setup, spec, "wheels", settings.encoder_ms * 1_000_000)
        self._limits, self._kinematics = settings.limits, settings.nominal
        self._motor_from_wheel = np.array(settings.signs, dtype=np.float64) * settings.gear_ratio / TURN_RAD  # (3,)

    @property
    def limits(self) -> BaseLimits:
        """What it may be asked."""
        return self._limits

    @property
    def kinematics(self) -> OmniThreeWheel:
        """The nominal geometry."""
        return self._kinematics

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
        if (drained := self._drained()) is None:
            return ()
        stamps, records = drained
        position, velocity = (frozen_array(records[name] / self._motor_from_wheel) for name in ("turns", "turns_s"))  # (n, 3)
        return tuple(map(WheelSample, stamps, position, velocity))


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
