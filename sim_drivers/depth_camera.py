"""A simulated Intel RealSense D455: depth by ray casting, then what a stereo camera makes of it."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from drivers.interface.devices import DeviceSetup
from drivers.interface.samples import DepthFrame, Intrinsics, Stamp, frozen_array
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.camera_mount import CameraMount
from sim_drivers.depth_noise import DepthNoiseSettings, spoil
from sim_drivers.ray_caster import RayCaster
from sim_drivers.sensor import SimSensor
from sim_drivers.world import MujocoWorld

# A D455's depth stream, as the clearance paper gives it (Cui, Deng, Wang, appendix D.3): 88.6 degrees horizontally.
D455 = Intrinsics(width=848, height=480, fx=434.27, fy=434.27, cx=431.77, cy=240.45)


def intrinsics(width: int, height: int, horizontal_fov_deg: float | None = None) -> Intrinsics:
    """Return the D455's intrinsics at a decimated size, or those of an ideal camera with another field of view.

    >>> intrinsics(848, 480) == D455
    True
    >>> ideal = intrinsics(200, 100, horizontal_fov_deg=90.0)
    >>> round(ideal.fx, 9), ideal.cx
    (100.0, 99.5)
    """
    if horizontal_fov_deg is not None:
        focal = width / (2.0 * math.tan(math.radians(horizontal_fov_deg) / 2.0))
        return Intrinsics(width, height, focal, focal, (width - 1) / 2.0, (height - 1) / 2.0)
    u, v = width / D455.width, height / D455.height
    # A pixel's centre has whole coordinates, so the image's corner, not its origin, is what stays in place.
    cx, cy = (D455.cx + 0.5) * u - 0.5, (D455.cy + 0.5) * v - 0.5
    return Intrinsics(width, height, D455.fx * u, D455.fy * v, cx, cy)


class DepthCameraSettings(CameraMount):
    """Settings of the simulated depth camera; the mount is the camera body's (x forward, y left, z up) in base.

    Least range at 848x480: 0.33 m by the matcher's 126 px of disparity, "close to 34 cm" and "0.4 m" by Intel's own word
    (librealsense, issues 9241 and 9977).
    """

    width: int = Field(default=160, ge=8, le=1280, description="pixels; a decimated stream is cast at its decimated size")
    height: int = Field(default=90, ge=8, le=720, description="pixels; 848x480 undecimated, 283x160 decimated by 3")
    horizontal_fov_deg: float | None = Field(default=None, ge=20.0, le=150.0, description="none: the D455's 88.6 degrees")
    rate_hz: float = Field(default=15.0, gt=0.0, le=90.0, description="frames per second")
    min_range_m: float = Field(
        default=0.4,
        ge=0.0,
        le=2.0,
        description="nothing nearer is reported; D455: 0.33 to 0.4 m",
    )
    range_max_m: float = Field(default=6.0, gt=0.0, le=20.0, description="nothing farther is reported; D455: 0.6 to 6 m is ideal")
    depth_unit_m: float = Field(default=0.001, ge=1e-4, le=0.01, description="of one count of the 16-bit depth")
    latency_s: float = Field(default=0.04, ge=0.0, le=1.0, description="from capture to the host")
    loss_probability: float = Field(default=0.002, ge=0.0, le=1.0, description="of a whole frame")
    sees_robot: bool = Field(default=False, description="whether the robot's own body is in the picture")
    noise: DepthNoiseSettings = DepthNoiseSettings()

    @model_validator(mode="after")
    def _ordered(self) -> DepthCameraSettings:
        if self.min_range_m >= self.range_max_m:
            raise ValueError(f"min_range_m ({self.min_range_m}) must be below range_max_m ({self.range_max_m})")
        if self.range_max_m / self.depth_unit_m > np.iinfo(np.uint16).max:
            raise ValueError(f"range_max_m ({self.range_max_m}) does not fit into 16 bits of {self.depth_unit_m} m")
        return self


class SimDepthCamera(SimSensor[DepthFrame]):
    """A RealSense D455 in the simulated world: ray-cast depth with its intrinsics, noise, holes, range, latency."""

    Settings: ClassVar[type[Settings]] = DepthCameraSettings
    role: ClassVar[str] = "camera"

    def __init__(self, settings: DepthCameraSettings, setup: DeviceSetup, lens: Intrinsics | None = None) -> None:
        """Register with the world; look through a given lens instead of that of the settings.

        Raises:
            ConfigurationError: there is no simulated world.
        """
        super().__init__(setup, settings.rate_hz, settings.latency_s, settings.loss_probability)
        self._settings = settings
        self._intrinsics = lens or intrinsics(settings.width, settings.height, settings.horizontal_fov_deg)
        self._base_from_optical = settings.base_from_optical
        self._base_id = 0
        self._caster: RayCaster | None = None

    def build(self, spec: Any, base: Any) -> None:
        """Add nothing: the camera only looks."""

    def bind(self, world: MujocoWorld) -> None:
        """Take over the model's geoms and cast a first image, so that nothing is compiled later.

        Raises:
            ConfigurationError: a geom is of a type that cannot be cast.
        """
        self._base_id = world.model.body("base").id
        self._caster = RayCaster(world.model, None if self._settings.sees_robot else "base")
        self._measure(world, Stamp(0, 0, 0))

    def latest(self) -> DepthFrame | None:
        """Return the newest frame not yet returned, or None."""
        frames = self.drain()
        return frames[-1] if frames else None

    def _measure(self, world: MujocoWorld, stamp: Stamp) -> DepthFrame:
        assert self._caster is not None  # bound before the world acts
        s, k = self._settings, self._intrinsics
        base_position, base_rotation = world.data.xpos[self._base_id], world.data.xmat[self._base_id].reshape(3, 3)
        position = base_position + base_rotation @ self._base_from_optical.translation
        rotation = base_rotation @ self._base_from_optical.rotation
        true_depth = self._caster.depth_image(world.data, position, rotation, k, s.range_max_m)
        generator = stream(self._setup.seed, self._setup.name, stamp.sequence)
        limits_m = (s.min_range_m, s.range_max_m, s.depth_unit_m)
        depth = spoil(true_depth, generator, s.noise, k.fx, k.fx * D455.width / k.width, limits_m)
        return DepthFrame(stamp, frozen_array(depth), s.depth_unit_m, k, self._base_from_optical)
