"""The geometry of a base as calibration found it; it takes the place of the base's own data sheet in the odometry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from drivers.interface.commands import BodyTwist
from drivers.interface.kinematics import Array, OmniThreeWheel, SkidSteer
from drivers.interface.settings import Settings

Length = Annotated[float, Field(gt=0.0, le=2.0)]
Bearing = Annotated[float, Field(ge=-7.0, le=7.0)]
SmallAngle = Annotated[float, Field(ge=-0.3, le=0.3)]


@dataclass(frozen=True, slots=True)
class TwoSided:
    """A skid-steer base whose sides roll on different radii: a `SkidSteer` whose wheels are counted in turns of equal ones.

    >>> TwoSided(0.1, 0.2, 0.5, 2).twist(np.array([2.0, 1.0])).wz
    0.0
    """

    left_radius_m: float
    right_radius_m: float
    effective_track_m: float
    wheel_count: int = 4

    @property
    def _equal(self) -> SkidSteer:
        return SkidSteer(1.0, self.effective_track_m, self.wheel_count)

    @property
    def _radii_m(self) -> Array:
        return np.tile((self.left_radius_m, self.right_radius_m), self.wheel_count // 2)

    def wheel_rates(self, twist: BodyTwist) -> Array:
        """Return the wheel rates [rad/s], shape (wheels,); raises ValueError for sideways motion."""
        return np.asarray(self._equal.wheel_rates(twist) / self._radii_m)

    def twist(self, wheel_rates: Array) -> BodyTwist:
        """Return the twist that the wheel rates [rad/s] give, the wheels of a side averaged."""
        return self._equal.twist(wheel_rates * self._radii_m)


class OmniGeometry(Settings):
    """Three omni wheels, each with its own errors."""

    kind: Literal["omni"] = "omni"
    wheel_radius_m: tuple[Length, Length, Length]
    wheel_distance_m: tuple[Length, Length, Length]
    wheel_bearing_rad: tuple[Bearing, Bearing, Bearing]
    heading_error_rad: tuple[SmallAngle, SmallAngle, SmallAngle] = (0.0, 0.0, 0.0)

    @property
    def kinematics(self) -> OmniThreeWheel:
        """The linear map that follows from it."""
        return OmniThreeWheel(self.wheel_radius_m, self.wheel_distance_m, self.wheel_bearing_rad, self.heading_error_rad)


class SkidSteerGeometry(Settings):
    """Two wheels a side, with a radius for each side."""

    kind: Literal["skid_steer"] = "skid_steer"
    left_radius_m: Length
    right_radius_m: Length
    effective_track_m: Annotated[float, Field(gt=0.0, le=5.0)]
    wheel_count: Literal[2, 4] = 4

    @property
    def kinematics(self) -> TwoSided:
        """The linear map that follows from it."""
        return TwoSided(self.left_radius_m, self.right_radius_m, self.effective_track_m, self.wheel_count)
