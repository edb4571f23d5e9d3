"""Where a simulated camera is mounted on the robot."""

from __future__ import annotations

import math

from pydantic import Field

from drivers.interface.geometry import BODY_FROM_OPTICAL, SE3
from drivers.interface.settings import Settings


class CameraMount(Settings):
    """The mount of the camera's body (x forward, y left, z up) in base."""

    x_m: float = Field(default=0.1, ge=-2.0, le=2.0, description="mount in base")
    y_m: float = Field(default=0.0, ge=-2.0, le=2.0, description="mount in base")
    z_m: float = Field(default=0.4, ge=0.0, le=3.0, description="mount above the floor")
    roll_rad: float = Field(default=0.0, ge=-math.pi, le=math.pi, description="mount about x")
    pitch_rad: float = Field(default=0.0, ge=-math.pi / 2, le=math.pi / 2, description="mount about y; positive looks down")
    yaw_rad: float = Field(default=0.0, ge=-math.pi, le=math.pi, description="mount about z")

    @property
    def base_from_optical(self) -> SE3:
        """The pose of the optical frame (x right, y down, z forward)."""
        mount = (self.x_m, self.y_m, self.z_m, self.roll_rad, self.pitch_rad, self.yaw_rad)
        return SE3.from_euler(*mount) @ BODY_FROM_OPTICAL
