"""How the wheels' controllers, and the base that they move, were built and set up before they came on the bus."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from drivers.interface.settings import Settings
from sim_drivers.firmware.axis import AxisSettings
from sim_drivers.firmware.can_simple import Version
from sim_drivers.firmware.frame_faults import FrameFault
from sim_drivers.firmware.wheel_power import PowerSettings
from sim_drivers.omni_base import Fraction, SmallAngle


class WheelControllerSettings(Settings):
    """All of it; what is sent unasked is set in milliseconds, as on the device."""

    version: Version = Field(default="0.6", description="of the firmware; the heartbeat's layout and the error bits go with it")
    wheels: Literal["rollers"] = Field(default="rollers", description="an axis that coasts needs wheels with real contact")
    mass_kg: float = Field(default=6.0, gt=1.0, le=500.0, description="of the whole base, wheels included")
    radius_m: float = Field(default=0.12, gt=0.02, le=1.0, description="of the round body")
    height_m: float = Field(default=0.30, gt=0.05, le=2.0, description="of the body")
    wheel_radius_error: tuple[Fraction, Fraction, Fraction] = Field(
        default=(0.003, -0.002, 0.001), description="how much larger each wheel really is, as a fraction"
    )
    wheel_heading_error_rad: tuple[SmallAngle, SmallAngle, SmallAngle] = Field(
        default=(0.003, -0.002, -0.002), description="how far each wheel really rolls off the tangent"
    )
    torque_nm: float = Field(default=2.9, gt=0.0, le=100.0, description="what a motor gives at most")
    friction_nm: float = Field(
        default=0.1, ge=0.0, le=10.0, description="of bearings and cogging; it is what stops a coasting wheel"
    )
    axis: AxisSettings = AxisSettings()
    power: PowerSettings = PowerSettings()
    encoder_counts_per_turn: int = Field(default=8192, ge=16, le=10_000_000, description="of the encoder, on the motor")
    heartbeat_ms: int = Field(default=100, ge=0, le=10_000, description="heartbeat_rate_ms; 0: only on request")
    encoder_ms: int = Field(default=10, ge=0, le=10_000, description="encoder_rate_ms")
    bus_ms: int = Field(default=100, ge=0, le=10_000, description="bus_vi_rate_ms")
    temperature_ms: int = Field(default=1000, ge=0, le=10_000, description="temperature_rate_ms (0.6)")
    error_ms: int = Field(default=0, ge=0, le=10_000, description="error_rate_ms")
    boot_s: float = Field(default=0.1, ge=0.0, le=60.0, description="from power-up to the first frame")
    latency_s: float = Field(default=0.001, ge=0.0, le=1.0, description="of a frame on its way to the host: controller and bus")
    loss_probability: float = Field(default=0.0005, ge=0.0, le=1.0, description="chance that a frame is lost on the way")
    faults: tuple[FrameFault, ...] = Field(default=(), description="misbehaviour, by script")
