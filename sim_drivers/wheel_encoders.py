"""Wheel encoders as a motor controller reports them: counted, jittering, filtered, sometimes lost, always a little late."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.samples import Stamp, WheelSample, frozen_array
from drivers.interface.settings import Settings
from sim_drivers.delivery import Delivery


class EncoderSettings(Settings):
    """How wheel angles are measured.  The defaults are those of a 12-bit magnetic encoder polled over a serial bus."""

    rate_hz: float = Field(default=100.0, gt=0.0, le=1000.0, description="samples per second")
    counts_per_rev: int = Field(default=4096, ge=16, le=10_000_000, description="counts per turn of the wheel")
    jitter_counts: float = Field(default=0.3, ge=0.0, le=100.0, description="standard deviation of the angle, before counting")
    velocity_lag_s: float = Field(default=0.015, ge=0.0, le=1.0, description="time constant of the filter on the counted rate")
    latency_s: float = Field(default=0.004, ge=0.0, le=1.0, description="from measuring to our side")
    loss_probability: float = Field(default=0.001, ge=0.0, le=1.0, description="chance that a sample is lost on the way")
    buffered_samples: int = Field(default=256, ge=1, le=100_000, description="samples that wait at most to be drained")

    @property
    def period_ns(self) -> int:
        """Time from one sample to the next [ns]."""
        return round(1e9 / self.rate_hz)


class WheelEncoders:
    """Measures wheel angles at its rate and sends what it measured.

    The rate that it reports is the counted angle's difference through a first-order filter, so it carries both the
    quantisation and the lag of the real thing.
    """

    def __init__(self, settings: EncoderSettings, rng: np.random.Generator, wheels: int, start_ns: int) -> None:
        """Start at rest with every wheel at its zero; all noise is drawn from `rng`, in the order of the samples."""
        self._settings = settings
        self._rng = rng
        self._step_rad = 2.0 * math.pi / settings.counts_per_rev
        self._next_ns = self._after(start_ns)
        self._last_ns: int | None = None
        self._sequence = 0
        self._position = np.zeros(wheels)
        self._velocity = np.zeros(wheels)
        self.delivery: Delivery[WheelSample] = Delivery(round(settings.latency_s * 1e9), settings.buffered_samples)
        self.dropped = 0

    def due(self, now_ns: int) -> bool:
        """Whether the time of the next sample has come."""
        return now_ns >= self._next_ns

    def measure(self, now_ns: int, angle_rad: NDArray[np.float64]) -> None:
        """Measure the true wheel angles, shape (wheels,), and send the sample, unless it is lost."""
        self._next_ns = self._after(now_ns)
        jitter = self._rng.normal(0.0, self._settings.jitter_counts, len(angle_rad))
        position = np.floor(angle_rad / self._step_rad + jitter) * self._step_rad
        self._velocity = self._filtered_rate(now_ns, position)
        self._position = position
        self._sequence += 1
        if self._rng.random() < self._settings.loss_probability:
            self.dropped += 1
            return
        stamp = Stamp(now_ns, now_ns + self.delivery.latency_ns, self._sequence)
        self.delivery.send(now_ns, WheelSample(stamp, frozen_array(position.copy()), frozen_array(self._velocity.copy())))

    def _after(self, now_ns: int) -> int:
        period_ns = self._settings.period_ns
        return (now_ns // period_ns + 1) * period_ns

    def _filtered_rate(self, now_ns: int, position: NDArray[np.float64]) -> NDArray[np.float64]:
        last_ns, self._last_ns = self._last_ns, now_ns
        if last_ns is None:
            return self._velocity
        elapsed_s, lag_s = (now_ns - last_ns) * 1e-9, self._settings.velocity_lag_s
        share = 1.0 - math.exp(-elapsed_s / lag_s) if lag_s > 0.0 else 1.0
        return self._velocity + share * ((position - self._position) / elapsed_s - self._velocity)
