"""The arm's own 1 kHz process: from a joint trajectory to set points that keep every limit, and to rest when it expires."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from drivers.interface.commands import JointLimits, JointTrajectory

F64 = NDArray[np.float64]

JOINTS = 7
POSITION_GAIN_1_S = 25.0
VELOCITY_GAIN_1_S = 100.0
STANDING_RAD_S, STANDING_RAD_S2 = 1e-4, 1e-2
BRAKE_SHARE = 0.8  # of the acceleration that closing a gap counts on; the rest is for the gains


def _row(*values: float) -> F64:
    return np.array(values)


# Franka Control Interface documentation, robot limits of the Panda.
PANDA = JointLimits(
    position_min_rad=_row(-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973),
    position_max_rad=_row(2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973),
    velocity_rad_s=_row(2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61),
    acceleration_rad_s2=_row(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),
    jerk_rad_s3=_row(7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0),
    torque_nm=_row(87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0),
)


class TrajectoryFollower:
    """Moves a set point of all joints along a trajectory, inside velocity, acceleration and jerk limits.

    Between knots the trajectory is a cubic Hermite spline.  A gap between set point and trajectory (a late start, a
    trajectory that asks too much) is closed no faster than the limits allow.
    """

    def __init__(self, limits: JointLimits, position_rad: F64) -> None:
        """Rest at `position_rad`, shape (7,)."""
        self._limits = limits
        self.position_rad = position_rad.copy()  # (7,)
        self.velocity_rad_s = np.zeros_like(position_rad)  # (7,)
        self._acceleration = np.zeros_like(position_rad)  # (7,)
        self._spline: CubicHermiteSpline | None = None
        self._speed_factor = 1.0
        self._start_ns = self._expires_ns = self._last_ns = 0
        self.expired = 0  # times the dead man had to act

    def follow(self, trajectory: JointTrajectory, expires_ns: int) -> None:
        """Follow a trajectory until `expires_ns`; one without knots is an order to stop."""
        if trajectory.is_rest:
            self.stop()
            return
        self._spline = CubicHermiteSpline(trajectory.time_from_start_s, trajectory.position_rad, trajectory.velocity_rad_s)
        self._start_ns, self._expires_ns = trajectory.start_ns, expires_ns
        self._speed_factor = trajectory.speed_factor

    @property
    def acceleration_rad_s2(self) -> F64:
        """Acceleration of the set point, shape (7,)."""
        return self._acceleration

    @property
    def is_following(self) -> bool:
        """Whether there is a trajectory to follow."""
        return self._spline is not None

    @property
    def is_at_rest(self) -> bool:
        """Whether the set point stands."""
        return bool((np.abs(self.velocity_rad_s) < STANDING_RAD_S).all() and (np.abs(self._acceleration) < STANDING_RAD_S2).all())

    def resume(self, position_rad: F64, velocity_rad_s: F64, acceleration_rad_s2: F64, now_ns: int) -> None:
        """Go on from where the set point really is at `now_ns`; each of the arrays has the shape (7,)."""
        self.position_rad, self.velocity_rad_s, self._acceleration = position_rad, velocity_rad_s, acceleration_rad_s2
        self._last_ns = now_ns

    def stop(self) -> None:
        """Forget the trajectory and decelerate to rest."""
        self._spline = None

    def step(self, now_ns: int) -> None:
        """Move the set point on to `now_ns`."""
        dt_s, self._last_ns = (now_ns - self._last_ns) * 1e-9, now_ns
        if dt_s <= 0.0:
            return
        velocity, acceleration = self._wanted(now_ns)
        limits, cap = self._limits, self._limits.acceleration_rad_s2
        slowest = -self._safe_speed(self.position_rad - limits.position_min_rad)
        fastest = self._safe_speed(limits.position_max_rad - self.position_rad)
        admitted = np.clip(velocity, slowest, fastest)
        acceleration = np.where(admitted == velocity, acceleration, 0.0)  # at a cap it would carry the joint beyond
        asked = acceleration + VELOCITY_GAIN_1_S * (admitted - self.velocity_rad_s)
        jerk = limits.jerk_rad_s3 * dt_s
        asked = np.clip(np.clip(asked, -cap, cap), self._acceleration - jerk, self._acceleration + jerk)
        self._acceleration = asked
        self.velocity_rad_s = self.velocity_rad_s + asked * dt_s
        self.position_rad = self.position_rad + self.velocity_rad_s * dt_s

    def _wanted(self, now_ns: int) -> tuple[F64, F64]:
        """Return velocity and acceleration to aim at, both (7,); zero without a valid trajectory."""
        rest = np.zeros_like(self.position_rad)
        if self._spline is None:
            return rest, rest
        elapsed_s, first_s, last_s = (now_ns - self._start_ns) * 1e-9, float(self._spline.x[0]), float(self._spline.x[-1])
        if now_ns >= self._expires_ns:
            self.expired += int(elapsed_s < last_s)  # one that was followed to its end is simply over
            self._spline = None
            return rest, rest
        gap = self._spline(min(max(elapsed_s, first_s), last_s)) - self.position_rad
        closing = np.minimum(POSITION_GAIN_1_S * np.abs(gap), self._safe_speed(np.abs(gap))) * np.sign(gap)
        if not first_s <= elapsed_s < last_s:
            return closing, rest
        return self._spline(elapsed_s, 1) + closing, self._spline(elapsed_s, 2)

    def _safe_speed(self, distance_rad: F64) -> F64:
        """Return the speed within the limits from which each joint still stops in its distance, both (7,)."""
        braking = np.sqrt(2.0 * BRAKE_SHARE * self._limits.acceleration_rad_s2 * np.maximum(distance_rad, 0.0))
        return np.asarray(np.minimum(self._speed_factor * self._limits.velocity_rad_s, braking), dtype=np.float64)
