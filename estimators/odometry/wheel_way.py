"""The way that wheels have made between two samples, and how far it can be believed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drivers.interface.kernel import kernel
from drivers.interface.kinematics import WheelKinematics
from drivers.interface.samples import WheelSample
from estimators.belief import F64
from estimators.odometry.ekf_settings import EkfSettings

LEAST = 1e-12  # m^2, rad^2: a base that cannot strafe counts nothing sideways at rest, and yet it is no certainty
PARALLEL = 1e-9  # rad: an arc that turns less is a straight line


class WheelWay(NamedTuple):
    """A way in the base frame of its beginning, with the twist at its end."""

    vector: F64  # (3,): x, y [m], yaw [rad] (not wrapped)
    twist: F64  # (3,): vx, vy [m/s], wz [rad/s]
    covariance: F64  # (3, 3) of the vector
    grip: F64  # (3, 3), the same for wheels that do not slip: what slip is told by


Fields = tuple[float, ...]


class Trust(NamedTuple):
    """How far wheels are believed, as the settings have it."""

    way_scale_std: float
    yaw_scale_std: float
    yaw_std_rad_per_m: float
    skid_along_std_m_per_rad: float
    skid_across_std_m_per_rad: float
    systematic_s: float
    position_variance_m2_per_m: float
    position_variance_m2_per_rad: float
    yaw_variance_rad2_per_m: float
    yaw_variance_rad2_per_rad: float
    stamp_std_s: float


class WheelModel:
    """Turns the turns of wheels into ways, along the arc of the mean twist.

    A skid-steer base turns about its instantaneous centres, which its effective track stands for; that it does not move
    sideways is then a measurement like the others, with the slip as its noise.  That holds in slow curves.  What turns a fast
    base inwards is the grip of tyres that slide already, and for that they have to slide outwards: the centres move ahead (the
    simulated Jackal's lie 0.04 m ahead of its middle at 0.6 m/s and 0.6 rad/s, 0.17 m at 1.8 m/s and 2.5 rad/s), and the wheels
    count more than the way (by 4 to 8 % above 2 rad/s).  `skid_along_std_m_per_rad` and `skid_across_std_m_per_rad`
    leave what skids so to the inertial unit.
    """

    def __init__(self, settings: EkfSettings, kinematics: WheelKinematics) -> None:
        """Learn the linear map from wheel turns to the body's way by asking for each wheel's share."""
        self.kinematics = kinematics
        twists = [kinematics.twist(turn) for turn in np.eye(kinematics.wheel_count)]
        self._columns = np.array([(twist.vx, twist.vy, twist.wz) for twist in twists]).T.copy()  # (3, wheels)
        self._counting = settings.encoder_noise_rad**2 * self._columns @ self._columns.T  # (3, 3)
        self._trust: Fields = tuple(getattr(settings, name) for name in Trust._fields)
        self._still = np.eye(3) * settings.still_std**2

    def warm_up(self) -> None:
        """Compile the kernel."""
        turns = np.zeros(self.kinematics.wheel_count)
        _way(self._columns, turns, turns, 1.0, self._counting, self._trust)

    def usable(self, sample: WheelSample) -> bool:
        """Tell whether a sample has as many finite values as the base has wheels."""
        count = (self.kinematics.wheel_count,)
        position, rates = sample.position_rad, sample.velocity_rad_s
        if position.shape != count or rates.shape != count:
            return False
        return bool(np.isfinite(position.dot(position)) and np.isfinite(rates.dot(rates)))

    def way(self, before_rad: F64, sample: WheelSample, elapsed_s: float) -> WheelWay:
        """Return the way since the wheels stood at `before_rad`, shape (wheels,)."""
        turns = sample.position_rad - before_rad
        # The rates come from a sample, whose arrays are read-only: a copy spares the kernel a second type to compile for.
        return WheelWay(*_way(self._columns, turns, sample.velocity_rad_s.copy(), elapsed_s, self._counting, self._trust))

    def standstill(self) -> WheelWay:
        """Return the way of a base that stands; it says more of the gyro's bias than wheels that are counted can."""
        return WheelWay(np.zeros(3), np.zeros(3), self._still, self._still)


@kernel()
def _way(
    columns: F64, turns: F64, rates: F64, elapsed_s: float, counting: F64, belief: tuple[float, ...]
) -> tuple[F64, F64, F64, F64]:
    """Return what a `WheelWay` holds of turns and rates, both of shape (wheels,); `belief`: the fields of a `Trust`."""
    trust = Trust(*belief)
    vector, twist = columns @ turns, columns @ rates  # of the tangent: (3,), (3,)
    dx, dy, turned = vector
    if abs(turned) > PARALLEL:
        a, b = np.sin(turned) / turned, (1.0 - np.cos(turned)) / turned
        vector[0], vector[1] = a * dx - b * dy, b * dx + a * dy
    way_m, angle = np.hypot(dx, dy), abs(turned)
    grip = counting.copy()
    way_error = (trust.way_scale_std * way_m) ** 2 + LEAST
    yaw_error = (trust.yaw_scale_std * angle) ** 2 + (trust.yaw_std_rad_per_m * way_m) ** 2
    grip[0, 0] += way_error + (trust.skid_along_std_m_per_rad * angle) ** 2
    grip[1, 1] += way_error + (trust.skid_across_std_m_per_rad * angle) ** 2
    grip[2, 2] += yaw_error + LEAST
    early = columns * (rates * trust.stamp_std_s)  # (3, wheels): each turned on for as long as its stamp is wrong
    grip += early @ early.T
    covariance = grip.copy()
    slip = trust.position_variance_m2_per_m * way_m + trust.position_variance_m2_per_rad * angle
    covariance[0, 0] += slip
    covariance[1, 1] += slip
    covariance[2, 2] += trust.yaw_variance_rad2_per_m * way_m + trust.yaw_variance_rad2_per_rad * angle
    covariance[2, 2] += yaw_error * max(0.0, trust.systematic_s / elapsed_s - 1.0)
    return vector, twist, covariance, grip


@kernel()
def farthest(one: F64, other: F64) -> float:
    """Return by how much the wheel that differs most differs, both of shape (wheels,)."""
    most = 0.0
    for i in range(len(one)):
        most = max(most, abs(one[i] - other[i]))
    return most
