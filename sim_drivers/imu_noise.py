"""What a MEMS inertial unit makes of true rates and forces: noise, a wandering bias, saturation, resolution."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.kernel import kernel
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings

F64 = NDArray[np.float64]

STANDARD_GRAVITY_M_S2 = 9.80665
_GYRO_LSB = math.radians(1.0 / 32.8)  # at +-1000 deg/s
_ACCEL_LSB = STANDARD_GRAVITY_M_S2 / 512.0  # 12 bits at +-4 g


class ImuNoiseSettings(Settings):
    """The errors of the Bosch BMI055 inside a D455, at the ranges that the camera sets (+-1000 deg/s, +-4 g).

    Sources: BMI055 data sheet BST-BMI055-DS000-08: output noise density 0.014 deg/s/sqrt(Hz) and 150 ug/sqrt(Hz), sensitivity
    32.8 LSB/(deg/s) and 512 LSB/g.  The data sheet says nothing of how the bias wanders, and its offsets (1 deg/s, 70 mg) are
    those before the camera's calibration: random walks are those of an Allan analysis of a D435i, which holds the same part
    (VINS-Mono, issue 472); the gyro's remaining bias is what librealsense's calibration of a D435i found (ORB-SLAM3, issue 125).
    """

    gyro_noise_rad_s_sqrt_hz: float = Field(default=2.44e-4, ge=0.0, le=0.1, description="density of white noise, one-sided")
    gyro_walk_rad_s2_sqrt_hz: float = Field(default=2.4e-6, ge=0.0, le=0.01, description="random walk of the bias")
    gyro_bias_rad_s: float = Field(default=2.5e-3, ge=0.0, le=0.1, description="deviation of the bias at switch-on")
    gyro_range_rad_s: float = Field(default=math.radians(1000.0), gt=0.0, le=100.0, description="saturates beyond")
    gyro_resolution_rad_s: float = Field(default=_GYRO_LSB, ge=0.0, le=1.0, description="one count")
    accel_noise_m_s2_sqrt_hz: float = Field(default=1.47e-3, ge=0.0, le=1.0, description="density of white noise, one-sided")
    accel_walk_m_s3_sqrt_hz: float = Field(default=6.3e-5, ge=0.0, le=0.1, description="random walk of the bias")
    accel_bias_m_s2: float = Field(default=0.05, ge=0.0, le=2.0, description="deviation of the bias at switch-on")
    accel_range_m_s2: float = Field(default=4 * STANDARD_GRAVITY_M_S2, gt=0.0, le=400.0, description="saturates beyond")
    accel_resolution_m_s2: float = Field(default=_ACCEL_LSB, ge=0.0, le=1.0, description="one count")


class ImuNoise:
    """Spoils the samples of one run in their order."""

    def __init__(self, settings: ImuNoiseSettings, rate_hz: float, seed: int, consumer: str) -> None:
        """Draw the biases at switch-on."""
        s = settings
        self._seed, self._consumer = seed, consumer
        self._block = max(1, round(rate_hz))  # samples per draw
        # A one-sided density fills the band up to half the sampling rate.
        self._white = _three_each(s.gyro_noise_rad_s_sqrt_hz, s.accel_noise_m_s2_sqrt_hz) * math.sqrt(rate_hz / 2.0)
        self._walk = _three_each(s.gyro_walk_rad_s2_sqrt_hz, s.accel_walk_m_s3_sqrt_hz) / math.sqrt(rate_hz)
        self._range = _three_each(s.gyro_range_rad_s, s.accel_range_m_s2)
        # Without a step of its own a value is as fine as a double is.
        self._resolution = np.maximum(_three_each(s.gyro_resolution_rad_s, s.accel_resolution_m_s2), 1e-15)
        switch_on = stream(seed, f"{consumer}.bias").standard_normal(6)
        self._bias = _three_each(s.gyro_bias_rad_s, s.accel_bias_m_s2) * switch_on  # (6,)
        self._error: F64 = np.empty((0, 6))  # of the samples of one block
        _counted(np.zeros(6), np.zeros(6), self._range, self._resolution)  # compiled by now

    def spoil(self, truth: F64, sequence: int) -> F64:
        """Return what is measured instead of true rates [rad/s] and specific force [m/s^2], both in one array (6,)."""
        block, row = divmod(sequence, self._block)
        if row == 0:
            white, steps = stream(self._seed, self._consumer, block).standard_normal((2, self._block, 6))
            bias = self._bias + np.cumsum(self._walk * steps, axis=0)
            self._bias, self._error = bias[-1], bias + self._white * white
        spoilt: F64 = _counted(truth, self._error[row], self._range, self._resolution)
        return spoilt


@kernel()
def _counted(truth: F64, error: F64, most: F64, count: F64) -> F64:
    """Return truth and error, saturated, in whole counts, each of shape (n,)."""
    counted = np.empty_like(truth)
    for i in range(len(truth)):
        counted[i] = np.rint(min(max(truth[i] + error[i], -most[i]), most[i]) / count[i]) * count[i]
    return counted


def _three_each(gyro: float, accel: float) -> F64:
    return np.repeat((gyro, accel), 3)
