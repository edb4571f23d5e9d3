"""What each kind of base makes of a velocity over ground: which ones it may be given, and the twist that follows one."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BaseLimits, BodyTwist
from planners.orca.nonholonomic import followable, followed

F64 = NDArray[np.float64]

_STANDING_M_S = 0.02
_CORNERS = 8  # of the polygon in a circle of speeds


class Motion(Protocol):
    """Velocities are in the body frame."""

    def permitted(self, error_m: float) -> tuple[F64, F64]:
        """Return the half-planes, shapes (n, 2) and (n,), of velocities that are followed within an error; bounded."""
        ...

    def preferred(self, velocity: F64, error_m: float) -> F64:
        """Return the velocity to prefer, shape (2,), for one that the route asks for."""
        ...

    def twist(self, velocity: F64, preferred: F64) -> BodyTwist:
        """Return the twist that follows the velocity chosen; `preferred` is faced while standing."""
        ...


class DifferentialMotion:
    """Forwards and turning; sideways only within the tracking error of a holonomic velocity."""

    def __init__(self, limits: BaseLimits, max_speed_m_s: float, turn_s: float) -> None:
        """Take the caps."""
        self._speed, self._rate, self._turn_s = min(limits.velocity.vx, max_speed_m_s), limits.velocity.wz, turn_s

    def permitted(self, error_m: float) -> tuple[F64, F64]:
        """Return the polygon of velocities that are followed within the error."""
        return followable(error_m, self._turn_s, self._rate, self._speed)

    def preferred(self, velocity: F64, error_m: float) -> F64:
        """Return the velocity slowed, its direction kept, until it is followable; abeam on its side when it leads backwards."""
        if velocity[0] < 0.0:
            velocity = np.array([0.0, math.copysign(math.hypot(*velocity), velocity[1])])
        normals, bounds = self.permitted(error_m)
        along = normals @ velocity
        share = np.min(bounds[along < -1e-9] / along[along < -1e-9], initial=1.0)
        return np.asarray(velocity * share)

    def twist(self, velocity: F64, preferred: F64) -> BodyTwist:
        """Return the arc of the paper; on the spot while standing."""
        standing = math.hypot(*velocity) < _STANDING_M_S
        speed, rate = followed(preferred if standing else velocity, self._turn_s, self._rate)
        return BodyTwist(0.0 if standing else min(speed, self._speed), 0.0, min(max(rate, -self._rate), self._rate))


class HolonomicMotion:
    """Any direction, turning to face it."""

    def __init__(self, limits: BaseLimits, max_speed_m_s: float, turn_s: float) -> None:
        """Take the caps."""
        cap = limits.velocity
        angles = np.arange(_CORNERS) * (2.0 * math.pi / _CORNERS)
        speed = min(cap.vx, max_speed_m_s)
        circle = -np.stack((np.cos(angles), np.sin(angles)), axis=1)
        self._normals = np.concatenate((circle, [[0.0, 1.0], [0.0, -1.0]]))
        inside = np.full(_CORNERS, -speed * math.cos(math.pi / _CORNERS))  # of the circle, corners included
        backwards = -speed if limits.reverse else 0.0
        self._normals = np.concatenate((self._normals, [[1.0, 0.0]]))
        self._bounds = np.concatenate((inside, [-cap.vy, -cap.vy, backwards]))
        self._rate, self._turn_s = cap.wz, turn_s

    def permitted(self, error_m: float) -> tuple[F64, F64]:
        """Return the polygon of speeds that the base can do; it follows all of them."""
        return self._normals, self._bounds

    def preferred(self, velocity: F64, error_m: float) -> F64:
        """Return the velocity as it is."""
        return velocity

    def twist(self, velocity: F64, preferred: F64) -> BodyTwist:
        """Return the velocity itself, turning to face it, or what is preferred while standing."""
        faced = preferred if math.hypot(*velocity) < _STANDING_M_S else velocity
        rate = math.atan2(faced[1], faced[0]) / self._turn_s if math.hypot(*faced) >= _STANDING_M_S else 0.0
        return BodyTwist(float(velocity[0]), float(velocity[1]), min(max(rate, -self._rate), self._rate))


def motion_of(limits: BaseLimits, max_speed_m_s: float, turn_s: float) -> Motion:
    """Return how a base with these limits moves."""
    kind = HolonomicMotion if limits.holonomic else DifferentialMotion
    return kind(limits, max_speed_m_s, turn_s)
