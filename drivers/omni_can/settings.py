"""How the base is built, how its controllers were set up, and which bus they are on."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.kinematics import OmniThreeWheel
from drivers.interface.settings import Settings
from drivers.omni_can.bus_load import HIGHEST_LOAD, frame_bits

TURN_RAD = 2.0 * math.pi
NodeId = Annotated[int, Field(ge=0, le=63)]
Sign = Literal[-1, 1]


class BusSettings(Settings):
    """Where the controllers are."""

    interface: str = Field(default="socketcan", description="of python-can: socketcan, slcan, virtual, udp_multicast, ...")
    channel: str = Field(default="can0", description="of that interface; a multicast address for udp_multicast")
    port: int = Field(default=43113, ge=1, le=65535, description="udp_multicast only")
    bit_rate: int = Field(default=500_000, ge=10_000, le=1_000_000, description="of the bus, in bits a second")

    @property
    def arguments(self) -> dict[str, Any]:
        """What `can.Bus` is given; a multicast bus never leaves this machine (hop limit 0)."""
        where = {"interface": self.interface, "channel": self.channel}
        if self.interface == "udp_multicast":
            return where | {"port": self.port, "hop_limit": 0, "fd": False}
        return where if self.interface in {"socketcan", "virtual"} else where | {"bitrate": self.bit_rate}

    @property
    def hears_itself(self) -> bool:
        """Whether what we send comes back to us."""
        return self.interface == "udp_multicast"


class OmniCanSettings(Settings):
    """Everything about the base.  Rates and watchdog are those that were saved in the controllers."""

    bus: BusSettings = Field(default_factory=BusSettings, description="the CAN bus")
    firmware: Literal["auto", "0.5", "0.6"] = Field(default="auto", description="auto: 0.6 answers Get_Version, 0.5 does not")
    dbc: Path | None = Field(default=None, description="a DBC file of your own for these controllers; then firmware must be told")
    node_ids: tuple[NodeId, NodeId, NodeId] = Field(default=(0, 1, 2), description="CAN node of each wheel")
    signs: tuple[Sign, Sign, Sign] = Field(default=(1, 1, 1), description="-1: the motor turns the other way round")
    gear_ratio: float = Field(default=1.0, gt=0.01, le=200.0, description="turns of the motor for one of the wheel")
    input_mode: Literal["passthrough", "vel_ramp"] = Field(default="passthrough", description="how an axis takes its set point")
    watchdog_s: float = Field(default=0.4, gt=0.02, le=2.0, description="watchdog_timeout of every axis; outlives a command")
    verify_watchdog: bool = Field(default=True, description="let every watchdog trip once, at rest, when the base is opened")
    encoder_ms: int = Field(default=10, ge=1, le=100, description="encoder_rate_ms of every axis")
    heartbeat_ms: int = Field(default=100, ge=10, le=1000, description="heartbeat_rate_ms")
    bus_ms: int = Field(default=100, ge=0, le=10_000, description="bus_vi_rate_ms; 0: not sent")
    temperature_ms: int = Field(default=1000, ge=0, le=10_000, description="temperature_rate_ms; 0: not sent")
    command_rate_hz: float = Field(default=50.0, gt=0.0, le=500.0, description="how often the loop commands, for the bus load")
    latency_s: float = Field(default=0.001, ge=0.0, le=0.1, description="from measuring to the frame's arrival")
    connect_s: float = Field(default=2.0, gt=0.1, le=30.0, description="until every axis must have been heard")
    silent_s: float = Field(default=0.3, gt=0.02, le=10.0, description="without an axis's frames for so long the wire is lost")
    brake_s: float = Field(default=0.5, ge=0.0, le=5.0, description="for how long zero is repeated after the last command")
    gather_s: float = Field(default=0.01, ge=0.0, le=0.02, description="frames that come so close together are read together")

    wheel_radius_m: float = Field(default=0.05, gt=0.01, le=0.5, description="of every wheel")
    wheel_distance_m: float = Field(default=0.10, gt=0.02, le=2.0, description="from the centre to each wheel")
    first_bearing_rad: float = Field(default=math.pi / 3, ge=-math.pi, le=math.pi, description="of the first wheel")
    max_vx_m_s: float = Field(default=0.75, gt=0.0, le=5.0, description="cap forwards and backwards")
    max_vy_m_s: float = Field(default=0.5, gt=0.0, le=5.0, description="cap sideways")
    max_wz_rad_s: float = Field(default=1.2, gt=0.0, le=10.0, description="cap on turning")
    acceleration_m_s2: float = Field(default=1.5, gt=0.0, le=20.0, description="cap on speeding up")
    angular_acceleration_rad_s2: float = Field(default=3.0, gt=0.0, le=50.0, description="cap on turning up")
    jerk_m_s3: float = Field(default=15.0, gt=0.0, le=1000.0, description="cap on jerk that a planner must keep")
    angular_jerk_rad_s3: float = Field(default=30.0, gt=0.0, le=1000.0, description="the same for turning")
    stop_deceleration_m_s2: float = Field(default=2.0, gt=0.0, le=20.0, description="how hard it brakes")
    stop_angular_deceleration_rad_s2: float = Field(default=6.0, gt=0.0, le=50.0, description="how hard it stops turning")
    battery_empty_v: float = Field(default=19.0, gt=0.0, le=100.0, description="bus voltage of the empty battery")
    battery_full_v: float = Field(default=25.2, gt=0.0, le=100.0, description="bus voltage of the full one")

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if len(set(self.node_ids)) < 3:
            raise ValueError(f"node_ids: every wheel needs a node of its own, not {self.node_ids}")
        if self.dbc is not None and self.firmware == "auto":
            raise ValueError("firmware: with a dbc of your own it must be told, '0.5' or '0.6'")
        if self.battery_full_v <= self.battery_empty_v:
            raise ValueError("battery_full_v: must be above battery_empty_v")
        if self.planned_bus_load > HIGHEST_LOAD:
            raise ValueError(
                f"bus.bit_rate: the messages take {100 * self.planned_bus_load:.0f} % of {self.bus.bit_rate} bit/s, and at most "
                f"{100 * HIGHEST_LOAD:.0f} % may be; lower encoder_ms, heartbeat_ms or command_rate_hz, or raise the bit rate"
            )
        return self

    @property
    def planned_bus_load(self) -> float:
        """Share of the bit rate that the messages take when nothing is asked besides."""
        periods_ms = (self.encoder_ms, self.heartbeat_ms, self.bus_ms, self.temperature_ms)
        frames_s = sum(1000.0 / period_ms for period_ms in periods_ms if period_ms) + self.command_rate_hz
        return len(self.node_ids) * frames_s * frame_bits(8) / self.bus.bit_rate

    @property
    def nominal(self) -> OmniThreeWheel:
        """The geometry on the drawing."""
        return OmniThreeWheel.symmetric(self.wheel_radius_m, self.wheel_distance_m, self.first_bearing_rad)

    @property
    def bus_arguments(self) -> dict[str, Any]:
        """Keyword arguments of `can.Bus`."""
        return self.bus.arguments

    @property
    def place(self) -> str:
        """The bus in a few words."""
        return f"{self.bus.interface} {self.bus.channel}"

    @property
    def limits(self) -> BaseLimits:
        """What the base may be asked."""

        def twist(linear: float, angular: float) -> BodyTwist:
            return BodyTwist(linear, linear, angular)

        return BaseLimits(
            velocity=BodyTwist(self.max_vx_m_s, self.max_vy_m_s, self.max_wz_rad_s),
            acceleration=twist(self.acceleration_m_s2, self.angular_acceleration_rad_s2),
            jerk=twist(self.jerk_m_s3, self.angular_jerk_rad_s3),
            stop_deceleration=twist(self.stop_deceleration_m_s2, self.stop_angular_deceleration_rad_s2),
        )

    @property
    def fastest_turns_s(self) -> float:
        """How fast a motor turns at the caps together; nothing twice as fast is believed."""
        rates = abs(self.nominal.rates_from_twist) @ (self.max_vx_m_s, self.max_vy_m_s, self.max_wz_rad_s)
        return float(max(rates)) * self.gear_ratio / TURN_RAD
