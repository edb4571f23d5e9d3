"""How wheel rates and body twist belong together, for the two kinds of base that Trundle drives."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BodyTwist

Array = NDArray[np.float64]


class WheelKinematics(Protocol):
    """A linear map between wheel rates and body twist."""

    @property
    def wheel_count(self) -> int:
        """Number of wheels."""
        ...

    def wheel_rates(self, twist: BodyTwist) -> Array:
        """Return the wheel rates [rad/s], shape (wheels,), that give the twist."""
        ...

    def twist(self, wheel_rates: Array) -> BodyTwist:
        """Return the twist that the wheel rates [rad/s] give (least squares where the wheels disagree)."""
        ...


def _twist_of(values: NDArray[np.floating]) -> BodyTwist:
    return BodyTwist(float(values[0]), float(values[1]), float(values[2]))


@dataclass(frozen=True, slots=True)
class OmniThreeWheel:
    """Three omni wheels on a circle, each driving along its tangent.

    Source: Siegwart, Nourbakhsh, Scaramuzza, Introduction to Autonomous Mobile Robots, 2nd ed., section 3.2.3 (Swedish
    wheel with a roller angle of zero).

    >>> base = OmniThreeWheel.symmetric(wheel_radius_m=0.05, wheel_distance_m=0.1)
    >>> round(base.twist(base.wheel_rates(BodyTwist(0.3, -0.2, 0.5))).vx, 12)
    0.3
    """

    wheel_radius_m: tuple[float, float, float]
    wheel_distance_m: tuple[float, float, float]  # from the base's origin to each wheel
    wheel_bearing_rad: tuple[float, float, float]  # direction from the origin to each wheel
    heading_error_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)  # of the rolling direction, off the tangent
    rates_from_twist: Array = field(init=False, repr=False, compare=False)  # (3, 3)
    _twist_from_rates: Array = field(init=False, repr=False, compare=False)  # (3, 3)

    def __post_init__(self) -> None:
        """Work out both matrices once; a base is asked hundreds of times a second."""
        radius = np.array(self.wheel_radius_m)
        bearing, heading = np.array(self.wheel_bearing_rad), np.array(self.heading_error_rad)
        rolling = bearing + math.pi / 2.0 + heading
        lever = np.array(self.wheel_distance_m) * np.cos(heading)
        rates = np.stack((np.cos(rolling), np.sin(rolling), lever), axis=1) / radius[:, None]
        object.__setattr__(self, "rates_from_twist", rates)
        object.__setattr__(self, "_twist_from_rates", np.linalg.inv(rates))

    @classmethod
    def symmetric(cls, wheel_radius_m: float, wheel_distance_m: float, first_bearing_rad: float = 0.0) -> OmniThreeWheel:
        """Build the usual base: three equal wheels 120 degrees apart."""
        r, d, third = wheel_radius_m, wheel_distance_m, 2.0 * math.pi / 3.0
        bearings = (first_bearing_rad, first_bearing_rad + third, first_bearing_rad + 2.0 * third)
        return cls((r, r, r), (d, d, d), bearings)

    @property
    def wheel_count(self) -> int:
        """Number of wheels."""
        return 3

    def wheel_rates(self, twist: BodyTwist) -> Array:
        """Return the wheel rates [rad/s], shape (3,)."""
        return np.asarray(self.rates_from_twist @ np.array([twist.vx, twist.vy, twist.wz]), dtype=np.float64)

    def twist(self, wheel_rates: Array) -> BodyTwist:
        """Return the twist that three wheel rates [rad/s] give; exact, the matrix is square."""
        return _twist_of(self._twist_from_rates @ wheel_rates)


@dataclass(frozen=True, slots=True)
class SkidSteer:
    """Two wheels a side that turn together; it turns by skidding, about an effective track wider than the geometric one.

    Source: Mandow et al., Experimental kinematics for wheeled skid-steer mobile robots, IROS 2007 (symmetric
    instantaneous-centre model).  Wheel order: front left, front right, rear left, rear right; with `wheel_count` 2:
    left, right.
    """

    wheel_radius_m: float
    effective_track_m: float
    wheel_count: int = 4

    @property
    def _rates_from_twist(self) -> Array:
        half = 0.5 * self.effective_track_m
        pair = np.array([[1.0, 0.0, -half], [1.0, 0.0, half]]) / self.wheel_radius_m
        return np.tile(pair, (self.wheel_count // 2, 1))

    def wheel_rates(self, twist: BodyTwist) -> Array:
        """Return the wheel rates [rad/s], shape (wheels,).

        Raises:
            ValueError: the twist asks for sideways motion.
        """
        if twist.vy != 0.0:
            raise ValueError(f"a skid-steer base cannot move sideways: vy = {twist.vy} m/s was asked")
        return np.asarray(self._rates_from_twist @ np.array([twist.vx, 0.0, twist.wz]), dtype=np.float64)

    def twist(self, wheel_rates: Array) -> BodyTwist:
        """Return the twist that the wheel rates [rad/s] give, both sides averaged."""
        left, right = float(np.mean(wheel_rates[0::2])), float(np.mean(wheel_rates[1::2]))
        vx = 0.5 * self.wheel_radius_m * (left + right)
        return BodyTwist(vx, 0.0, self.wheel_radius_m * (right - left) / self.effective_track_m)
