"""From rest to rest along a straight line in joint space: a quintic in time, as slow as the limits ask."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import JointLimits

F64 = NDArray[np.float64]

# Peaks of the derivatives of s(u) = 10 u^3 - 15 u^4 + 6 u^5 on [0, 1].
PEAK_VELOCITY = 15.0 / 8.0
PEAK_ACCELERATION = 10.0 / np.sqrt(3.0)
PEAK_JERK = 60.0
SHORTEST_S = 0.1


def duration_s(distance_rad: F64, limits: JointLimits, shares: tuple[float, float, float]) -> float:
    """Return the shortest duration in which every joint goes its distance, shape (joints,), inside shares of its limits.

    >>> import numpy as np
    >>> one, shares = np.ones(1), (1.0, 1.0, 1.0)
    >>> limits = JointLimits(-one, one, one, 100.0 * one, 1e6 * one, one)
    >>> duration_s(np.array([1.6]), limits, shares)
    3.0
    """
    distance, (velocity, acceleration, jerk) = np.abs(distance_rad), shares
    bounds = (
        PEAK_VELOCITY * distance / (velocity * limits.velocity_rad_s),
        np.sqrt(PEAK_ACCELERATION * distance / (acceleration * limits.acceleration_rad_s2)),
        np.cbrt(PEAK_JERK * distance / (jerk * limits.jerk_rad_s3)),
    )
    return max(SHORTEST_S, *(float(bound.max()) for bound in bounds))


def knots_between(start_rad: F64, end_rad: F64, duration: float, count: int) -> tuple[F64, F64, F64]:
    """Return times (count,), positions and velocities (count, joints) of the quintic between two positions (joints,)."""
    u = np.linspace(0.0, 1.0, count)
    progress = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    rate = 30.0 * u**2 * (1.0 - u) ** 2 / duration
    way = end_rad - start_rad
    return u * duration, start_rad + np.outer(progress, way), np.outer(rate, way)
