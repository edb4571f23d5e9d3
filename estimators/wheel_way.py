"""The way that wheels have made between two samples, and how far it can be believed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.kinematics import WheelKinematics
from drivers.interface.samples import WheelSample
from estimators.belief import F64
from estimators.ekf_settings import EkfSettings

LEAST = 1e-12  # m^2, rad^2: a base that cannot strafe counts nothing sideways at rest, and yet it is no certainty


@dataclass(frozen=True, slots=True)
class WheelWay:
    """A way in the base frame of its beginning, with the twist at its end."""

    motion: SE2
    turned_rad: float  # not wrapped
    twist: BodyTwist
    covariance: F64  # (3, 3) of the motion: x, y [m], yaw [rad]
    grip: F64  # (3, 3), the same for wheels that do not slip: what slip is told by

    @property
    def vector(self) -> F64:
        """The way as x, y [m] and yaw [rad], shape (3,)."""
        return np.array((self.motion.x, self.motion.y, self.turned_rad))


class WheelModel:
    """Turns the turns of wheels into ways, along the arc of the mean twist.

    A skid-steer base turns about its instantaneous centres, which its effective track stands for; that it does not move
    sideways is then a measurement like the others, with the slip as its noise.
    """

    def __init__(self, settings: EkfSettings, kinematics: WheelKinematics) -> None:
        """Learn the linear map from wheel turns to the body's way by asking for each wheel's share."""
        self._settings = settings
        self.kinematics = kinematics
        twists = [kinematics.twist(turn) for turn in np.eye(kinematics.wheel_count)]
        columns = np.array([(twist.vx, twist.vy, twist.wz) for twist in twists]).T  # (3, wheels)
        self._counting = settings.encoder_noise_rad**2 * columns @ columns.T  # (3, 3)

    def usable(self, sample: WheelSample) -> bool:
        """Tell whether a sample has as many finite values as the base has wheels."""
        count = (self.kinematics.wheel_count,)
        return (
            sample.position_rad.shape == sample.velocity_rad_s.shape == count
            and bool(np.isfinite(sample.position_rad).all())
            and bool(np.isfinite(sample.velocity_rad_s).all())
        )

    def way(self, before_rad: F64, sample: WheelSample, elapsed_s: float) -> WheelWay:
        """Return the way since the wheels stood at `before_rad`, shape (wheels,)."""
        mean = self.kinematics.twist((sample.position_rad - before_rad) / elapsed_s)
        motion = SE2().integrate(mean.vx, mean.vy, mean.wz, elapsed_s)
        way_m, turned_rad = mean.speed_m_s * elapsed_s, mean.wz * elapsed_s
        twist = self.kinematics.twist(sample.velocity_rad_s)
        grip = self._grip(way_m, abs(turned_rad))
        return WheelWay(motion, turned_rad, twist, self._slipping(grip, way_m, abs(turned_rad)), grip)

    def standstill(self) -> WheelWay:
        """Return the way of a base that stands; it says more of the gyro's bias than wheels that are counted can."""
        covariance = np.eye(3) * self._settings.still_std**2
        return WheelWay(SE2(), 0.0, BodyTwist(), covariance, covariance)

    def _grip(self, way_m: float, turned_rad: float) -> F64:
        """Counting, and a geometry that is not quite right."""
        s = self._settings
        covariance: F64 = self._counting.copy()
        way, yaw = (s.way_scale_std * way_m) ** 2 + LEAST, (s.yaw_scale_std * turned_rad) ** 2 + LEAST
        covariance[0, 0] += way
        covariance[1, 1] += way
        covariance[2, 2] += yaw
        return covariance

    def _slipping(self, grip: F64, way_m: float, turned_rad: float) -> F64:
        """And slip, which grows with the way and with the turn."""
        s, covariance = self._settings, grip.copy()
        position = s.position_variance_m2_per_m * way_m + s.position_variance_m2_per_rad * turned_rad
        covariance[0, 0] += position
        covariance[1, 1] += position
        covariance[2, 2] += s.yaw_variance_rad2_per_m * way_m + s.yaw_variance_rad2_per_rad * turned_rad
        return covariance
