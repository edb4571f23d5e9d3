"""Layer 1 on arrays: how old each cell's observation is, and which cells will be occupied on arrival."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from estimators.belief import F32, F64, Mask


class Arrival(NamedTuple):
    """What equation 2 needs besides the field."""

    speed_m_s: float  # that arrivals are expected at
    horizon_max_s: float
    trust_decay_s: float
    confidence_decay_s: float


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def observe(
    age_s: F32, known: Mask, corner: F64, cell_m: float, pose: F64, half_fov_rad: float, range_m: float, dt_s: float
) -> None:
    """Let observations, shape (rows, columns) [s], grow older by dt_s, and those in the sector of view be new."""
    cosine, c, s = np.cos(half_fov_rad), np.cos(pose[2]), np.sin(pose[2])
    for row in range(age_s.shape[0]):
        y = corner[1] + (row + 0.5) * cell_m - pose[1]
        for column in range(age_s.shape[1]):
            x = corner[0] + (column + 0.5) * cell_m - pose[0]
            distance2 = x * x + y * y
            seen = known[row, column] and distance2 <= range_m * range_m and c * x + s * y >= cosine * np.sqrt(distance2)
            age_s[row, column] = np.float32(0.0) if seen else age_s[row, column] + np.float32(dt_s)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def occupied_on_arrival(
    clearance: F32, rate: F32, age_s: F32, corner: F64, cell_m: float, robot: F64, arrival: Arrival
) -> NDArray[np.uint8]:
    """Return where equation 2 leaves no clearance, 0 there and 1 elsewhere, shape (rows, columns).

    Source: Cui, Deng, Wang, equation 2: clearance + h c c_pred rate <= 0, with h the time to get there, c the confidence in an
    observation of this age and c_pred the trust in a rate over h.
    """
    free = np.empty(clearance.shape, np.uint8)
    for row in range(clearance.shape[0]):
        y = corner[1] + (row + 0.5) * cell_m - robot[1]
        for column in range(clearance.shape[1]):
            value, change = clearance[row, column], rate[row, column]
            if change < 0.0 < value:
                x = corner[0] + (column + 0.5) * cell_m - robot[0]
                h = min(np.sqrt(x * x + y * y) / arrival.speed_m_s, arrival.horizon_max_s)
                trust = np.exp(-h / arrival.trust_decay_s - age_s[row, column] / arrival.confidence_decay_s)
                value = value + h * trust * change
            free[row, column] = value > 0.0
    return free
