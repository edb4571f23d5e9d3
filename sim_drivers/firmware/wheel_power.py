"""What three motors draw from a battery, and how warm they get: first-order models, for what a host is told."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.settings import Settings

F64 = NDArray[np.float64]


class PowerSettings(Settings):
    """Battery and motors; the defaults are a pack of six lithium-ion cells and small hub motors."""

    open_voltage_v: float = Field(default=24.6, gt=5.0, le=100.0, description="of the battery at the start")
    resistance_ohm: float = Field(default=0.08, ge=0.0, le=10.0, description="of battery and leads")
    capacity_ah: float = Field(default=10.0, gt=0.01, le=1000.0, description="of the battery, full at the start")
    empty_voltage_v: float = Field(default=19.0, gt=1.0, le=100.0, description="open voltage of the empty battery")
    idle_current_a: float = Field(default=0.08, ge=0.0, le=10.0, description="of each controller")
    torque_constant_nm_a: float = Field(default=0.4, gt=0.001, le=10.0, description="of each motor")
    phase_resistance_ohm: float = Field(default=0.3, gt=0.0, le=10.0, description="of each motor")
    ambient_c: float = Field(default=25.0, ge=-40.0, le=80.0, description="of the air, and of everything at the start")
    heating_k_per_w: float = Field(default=1.5, ge=0.0, le=100.0, description="of motor and power stage, when they have settled")
    heating_s: float = Field(default=300.0, gt=0.0, le=10_000.0, description="time constant of the warming")


class WheelPower:
    """Currents, the battery's voltage and temperatures, from the torques and rates of the wheels."""

    def __init__(self, settings: PowerSettings, now_ns: int) -> None:
        """Start at rest, cold, with a full battery."""
        self._settings = settings
        self._last_ns = now_ns
        self._phase_a = np.zeros(3)
        self._bus_a = np.full(3, settings.idle_current_a)
        self._heat_w = np.zeros(3)
        self._used_ah = 0.0
        self._warmer_k = np.zeros(3)

    @property
    def voltage_v(self) -> float:
        """Of the bus, under load."""
        s = self._settings
        share = min(self._used_ah / s.capacity_ah, 1.0)
        return s.open_voltage_v + share * (s.empty_voltage_v - s.open_voltage_v) - s.resistance_ohm * float(self._bus_a.sum())

    def current_a(self, axis: int) -> float:
        """Return what an axis draws from the bus [A]; braking feeds it."""
        return float(self._bus_a[axis])

    def iq_a(self, axis: int) -> tuple[float, float]:
        """Return a motor's torque-giving current [A], set point and measured."""
        return float(self._phase_a[axis]), float(self._phase_a[axis])

    def temperature_c(self, axis: int) -> tuple[float, float]:
        """Return the temperatures of power stage and motor [degrees C]."""
        warmer_k = float(self._warmer_k[axis])
        return self._settings.ambient_c + 0.6 * warmer_k, self._settings.ambient_c + warmer_k

    def step(self, now_ns: int, torque_nm: F64, rate_rad_s: F64) -> None:
        """Advance to a time with the torques and rates, shape (3,) each, since the last."""
        s, elapsed_s = self._settings, (now_ns - self._last_ns) * 1e-9
        self._last_ns = now_ns
        self._phase_a = torque_nm / s.torque_constant_nm_a
        self._heat_w = s.phase_resistance_ohm * self._phase_a**2
        self._bus_a = s.idle_current_a + (torque_nm * rate_rad_s + self._heat_w) / s.open_voltage_v
        self._used_ah += float(self._bus_a.sum()) * elapsed_s / 3600.0
        share = 1.0 - math.exp(-elapsed_s / s.heating_s)
        self._warmer_k = self._warmer_k + share * (s.heating_k_per_w * self._heat_w - self._warmer_k)
