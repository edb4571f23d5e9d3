"""Layer 1 on arrays: how old each cell's observation is, and which cells will be taken on arrival."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drivers.interface.kernel import kernel
from estimators.belief import F32, F64, U8, Mask


class Arrival(NamedTuple):
    """What equation 2 needs besides the field."""

    speed_m_s: float  # that arrivals are expected at
    horizon_max_s: float
    trust_decay_s: float
    confidence_decay_s: float


@kernel()
def observe(
    age_s: F32, known: Mask, corner: F64, cell_m: float, pose: F64, half_fov_rad: float, ranges_m: tuple[float, float, float],
    dt_s: float,
) -> None:  # fmt: skip
    """Let observations, shape (rows, columns) [s], grow older by dt_s, and those in the sector of view be new.

    `ranges_m` are the ground that the robot stands on, where the sector begins, and where it ends.
    """
    body_m, near_m, range_m = ranges_m
    cosine, c, s = np.cos(half_fov_rad), np.cos(pose[2]), np.sin(pose[2])
    for row in range(age_s.shape[0]):
        y = corner[1] + (row + 0.5) * cell_m - pose[1]
        for column in range(age_s.shape[1]):
            x = corner[0] + (column + 0.5) * cell_m - pose[0]
            distance2 = x * x + y * y
            seen = near_m * near_m <= distance2 <= range_m * range_m and c * x + s * y >= cosine * np.sqrt(distance2)
            seen = known[row, column] and (seen or distance2 <= body_m * body_m)
            age_s[row, column] = np.float32(0.0) if seen else age_s[row, column] + np.float32(dt_s)


@kernel()
def taken_on_arrival(clearance: F32, rate: F32, age_s: F32, corner: F64, cell_m: float, robot: F64, arrival: Arrival) -> U8:
    """Return 1 where there is clearance now and equation 2 leaves none, 0 elsewhere, shape (rows, columns).

    Source: Cui, Deng, Wang, equation 2: clearance + h c c_pred rate, with h the time to get there, c the confidence in an
    observation of this age and c_pred the trust in a rate over h.
    """
    taken = np.zeros(clearance.shape, np.uint8)
    for row in range(clearance.shape[0]):
        y = corner[1] + (row + 0.5) * cell_m - robot[1]
        for column in range(clearance.shape[1]):
            value, change = clearance[row, column], rate[row, column]
            if change < 0.0 < value:
                x = corner[0] + (column + 0.5) * cell_m - robot[0]
                h = min(np.sqrt(x * x + y * y) / arrival.speed_m_s, arrival.horizon_max_s)
                confidence = np.exp(-age_s[row, column] / arrival.confidence_decay_s)
                trust = arrival.trust_decay_s / (arrival.trust_decay_s + h)
                taken[row, column] = value + h * confidence * trust * change <= 0.0
    return taken
