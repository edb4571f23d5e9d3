"""The motion model of a track: constant velocity, driven by white acceleration; the algebra is FilterPy's.

Source: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, section 6.3.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from filterpy.common import Q_discrete_white_noise
from filterpy.kalman import predict, update

from drivers.interface.samples import frozen_array
from estimators.belief import F64

POSITION = np.eye(2, 4)  # what of the state is measured
PLANE = np.eye(2)


@dataclass(frozen=True, slots=True)
class Motion:
    """Position and velocity in odom, with covariance."""

    state: F64  # (4,): x, y [m], vx, vy [m/s]
    covariance: F64  # (4, 4)


@lru_cache(maxsize=64)  # frames and ticks come in a beat, so that few times occur
def _over(elapsed_s: float, acceleration_m_s2: float) -> tuple[F64, F64]:
    """Return the transition of the state over a time, and the covariance that it adds: (4, 4) each."""
    noise = Q_discrete_white_noise(dim=2, dt=elapsed_s, var=acceleration_m_s2**2, block_size=2, order_by_dim=False)
    return frozen_array(np.eye(4) + elapsed_s * np.eye(4, k=2)), frozen_array(np.asarray(noise))


class ConstantVelocity:
    """Carries motions over one stretch of time."""

    def __init__(self, elapsed_s: float, acceleration_m_s2: float) -> None:
        """`acceleration_m_s2` is the standard deviation of what changes the velocity."""
        self._transition, self._noise = _over(elapsed_s, acceleration_m_s2)

    def carry(self, motion: Motion) -> Motion:
        """Return the motion after the time."""
        state, covariance = predict(motion.state, motion.covariance, self._transition, self._noise)
        return Motion(state, covariance)


def corrected(motion: Motion, position_m: F64, covariance_m2: F64) -> Motion:
    """Return the motion after a position, shape (2,), was measured with a covariance, shape (2, 2)."""
    state, covariance = update(motion.state, motion.covariance, position_m, covariance_m2, POSITION)
    return Motion(state, 0.5 * (covariance + covariance.T))


def shifted(motion: Motion, offset_m: F64) -> Motion:
    """Return the motion of a point that goes along at an offset, shape (2,)."""
    return Motion(motion.state + np.concatenate((offset_m, np.zeros(2))), motion.covariance)


def squared_distance(motion: Motion, position_m: F64, covariance_m2: F64) -> float:
    """Return the squared Mahalanobis distance of a measured position, shape (2,), with a covariance, shape (2, 2)."""
    offset = position_m - motion.state[:2]
    return float(offset @ np.linalg.solve(motion.covariance[:2, :2] + covariance_m2, offset))


def squared_distances(motions: Sequence[Motion], positions_m: F64, sigmas_m: F64) -> F64:
    """Return the squared Mahalanobis distances, shape (n,), of n measured positions from n motions, one each.

    Args:
        motions: n of them; the same one may come again.
        positions_m: shape (n, 2).
        sigmas_m: of the positions, shape (n,).
    """
    offset = positions_m - np.array([motion.state[:2] for motion in motions])
    spread = np.array([motion.covariance[:2, :2] for motion in motions]) + sigmas_m[:, None, None] ** 2 * PLANE  # (n, 2, 2)
    return np.asarray(np.einsum("ni,nij,nj->n", offset, np.linalg.inv(spread), offset))
