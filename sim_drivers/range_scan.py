"""A simulated planar range scanner, for evaluation."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from drivers.interface.devices import DeviceSetup
from drivers.interface.samples import RangeScan, Stamp, frozen_array
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.ray_caster import RayCaster
from sim_drivers.sensor import SimSensor
from sim_drivers.world import MujocoWorld


class RangeScannerSettings(Settings):
    """Settings of the scanner, which stands over base's origin.

    The defaults are those of a Hokuyo UST-10LX (its specification): 270 degrees, 0.06 to 10 m, 40 Hz, deviation of
    repeated measurements below 30 mm; with half a degree between beams instead of a quarter.
    """

    angle_min_rad: float = Field(default=-0.75 * math.pi, ge=-math.pi, le=math.pi, description="direction of the first beam")
    angle_max_rad: float = Field(default=0.75 * math.pi, ge=-math.pi, le=math.pi, description="direction of the last beam")
    beams: int = Field(default=541, ge=2, le=10_000, description="beams of one scan")
    height_m: float = Field(default=0.2, ge=0.0, le=3.0, description="of the scan's plane over the floor")
    rate_hz: float = Field(default=40.0, gt=0.0, le=200.0, description="scans per second")
    range_min_m: float = Field(default=0.06, ge=0.0, le=10.0, description="nearer is invalid (NaN)")
    range_max_m: float = Field(default=10.0, gt=0.0, le=200.0, description="farther is no return (inf)")
    noise_m: float = Field(default=0.015, ge=0.0, le=1.0, description="deviation of one range")
    dropout_probability: float = Field(default=0.001, ge=0.0, le=1.0, description="of one beam to be invalid (NaN)")
    latency_s: float = Field(default=0.025, ge=0.0, le=1.0, description="from capture to the host; a scan takes a turn")
    loss_probability: float = Field(default=0.0005, ge=0.0, le=1.0, description="of a whole scan")
    buffered_samples: int = Field(default=40, ge=1, le=10_000, description="how many wait for the loop")

    @model_validator(mode="after")
    def _ordered(self) -> RangeScannerSettings:
        if self.angle_min_rad >= self.angle_max_rad:
            raise ValueError(f"angle_min_rad ({self.angle_min_rad}) must be below angle_max_rad ({self.angle_max_rad})")
        if self.range_min_m >= self.range_max_m:
            raise ValueError(f"range_min_m ({self.range_min_m}) must be below range_max_m ({self.range_max_m})")
        return self


class SimRangeScanner(SimSensor[RangeScan]):
    """A planar range scanner in the simulated world: ray-cast ranges with noise, dropouts and latency."""

    Settings: ClassVar[type[Settings]] = RangeScannerSettings
    role: ClassVar[str] = "scan"

    def __init__(self, settings: RangeScannerSettings, setup: DeviceSetup) -> None:
        """Register with the world.

        Raises:
            ConfigurationError: there is no simulated world.
        """
        super().__init__(setup, settings.rate_hz, settings.latency_s, settings.loss_probability, settings.buffered_samples)
        self._settings = settings
        angles = np.linspace(settings.angle_min_rad, settings.angle_max_rad, settings.beams)
        self._directions = np.stack((np.cos(angles), np.sin(angles), np.zeros(settings.beams)), axis=1)  # (beams, 3) in base
        self._angle_step_rad = (settings.angle_max_rad - settings.angle_min_rad) / (settings.beams - 1)
        self._caster: RayCaster | None = None
        self._base_id = 0

    def build(self, spec: Any, base: Any) -> None:
        """Add nothing: the scanner only looks."""

    def bind(self, world: MujocoWorld) -> None:
        """Take over the model's geoms and scan once, so that nothing is compiled later.

        Raises:
            ConfigurationError: a geom is of a type that cannot be cast.
        """
        self._base_id = world.model.body("base").id
        self._caster = RayCaster(world.model, "base")
        self._measure(world, Stamp(0, 0, 0))

    def _measure(self, world: MujocoWorld, stamp: Stamp) -> RangeScan:
        assert self._caster is not None  # bound before the world acts
        s = self._settings
        position, rotation = world.data.xpos[self._base_id], world.data.xmat[self._base_id].reshape(3, 3)
        origin = position + rotation @ np.array([0.0, 0.0, s.height_m])
        true_range = self._caster.ranges(world.data, origin, self._directions @ rotation.T, s.range_max_m)
        generator = stream(self._setup.seed, self._setup.name, stamp.sequence)
        measured = true_range + s.noise_m * generator.standard_normal(s.beams)
        measured[measured > s.range_max_m] = np.inf
        measured[(measured < s.range_min_m) | (generator.random(s.beams) < s.dropout_probability)] = np.nan
        return RangeScan(stamp, s.angle_min_rad, self._angle_step_rad, frozen_array(measured), s.range_max_m)
