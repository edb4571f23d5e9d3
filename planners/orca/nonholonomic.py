"""How a base that cannot move sideways follows a holonomic velocity, and which of them it follows within an error.

Source: Alonso-Mora, Breitenmoser, Rufli, Beardsley, Siegwart, Optimal reciprocal collision avoidance for multiple
non-holonomic robots, DARS 2010, sections 3 and 4.  The base turns to the velocity's direction theta on an arc, at a constant
rate in the time max(T, |theta| / w_max), and drives straight on from there.  The speed on the arc that leaves the smallest
distance to the holonomic robot makes that distance E = V t |sin(theta / 2)|.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

_STRAIGHT_RAD = 1e-3
_SIDES = 6  # of the polygon, from straight ahead to abeam


def turning_time_s(angle_rad: float, turn_s: float, max_rate_rad_s: float) -> float:
    """Return how long the arc towards a direction takes [s]."""
    return max(turn_s, abs(angle_rad) / max_rate_rad_s)


def tracking_error_m(speed_m_s: float, angle_rad: float, turn_s: float, max_rate_rad_s: float) -> float:
    """Return how far the base ends beside the holonomic robot that moves at a speed in a direction of the body frame [m]."""
    return speed_m_s * turning_time_s(angle_rad, turn_s, max_rate_rad_s) * abs(math.sin(0.5 * angle_rad))


def followed(velocity: F64, turn_s: float, max_rate_rad_s: float) -> tuple[float, float]:
    """Return forward speed [m/s] and rate [rad/s] that follow a velocity of the body frame, shape (2,), from now on."""
    angle = math.atan2(velocity[1], velocity[0])
    rate = angle / turning_time_s(angle, turn_s, max_rate_rad_s)
    share = 1.0 if abs(angle) < _STRAIGHT_RAD else 0.5 * angle / math.tan(0.5 * angle)
    return math.hypot(*velocity) * share, rate


def followable(error_m: float, turn_s: float, max_rate_rad_s: float, max_speed_m_s: float) -> tuple[F64, F64]:
    """Return the half-planes normal . v >= bound, shapes (n, 2) and (n,), of velocities that are followed within an error.

    They bound a convex polygon in the body frame, inside the set of the paper: from standing still to the speed cap, and
    sideways between corners on the curve E = error.
    """
    angles = np.linspace(0.5 * math.pi, 0.0, _SIDES, endpoint=False)
    speeds = [error_m / tracking_error_m(1.0, float(a), turn_s, max_rate_rad_s) for a in angles]
    corner = np.stack((speeds * np.cos(angles), speeds * np.sin(angles)), axis=1)  # from abeam to ahead, convex
    corner = np.concatenate((corner, [[corner[-1, 0] + max_speed_m_s, corner[-1, 1]]]))
    side = np.diff(corner, axis=0)
    left = np.stack((side[:, 1], -side[:, 0]), axis=1) / np.hypot(*side.T)[:, None]  # inwards, to the right
    bound = np.sum(left * corner[:-1], axis=1)
    normals = np.concatenate((left, left * [1.0, -1.0], [[1.0, 0.0], [-1.0, 0.0]]))
    return normals, np.concatenate((bound, bound, [0.0, -max_speed_m_s]))
