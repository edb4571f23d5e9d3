"""Tracks as arrays, the way predictors take them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import F64, Mask, Track


@dataclass(frozen=True, slots=True)
class Observed:
    """The tracks of one belief; axes are taken as independent and alike."""

    identity: NDArray[np.int64]  # (obstacles,)
    state: F64  # (obstacles, 4): x, y [m], vx, vy [m/s] in odom
    spread: F64  # (obstacles, 3): variance of position, covariance, variance of velocity, mean of the axes
    radius_m: F64  # (obstacles,)
    left_out: int = 0  # tracks that were not finite

    def __len__(self) -> int:
        """Return how many obstacles there are."""
        return len(self.identity)


def observed(tracks: tuple[Track, ...]) -> Observed:
    """Return the tracks as arrays, without those that are not finite."""
    rows = np.array(
        [(track.identity, *track.position_in_odom, *track.velocity_in_odom, track.radius_m) for track in tracks], np.float64
    ).reshape(-1, 6)
    covariance = np.array([track.covariance for track in tracks]).reshape(-1, 4, 4)
    sound, spread = _spreads(rows, covariance)
    if not sound.all():
        rows, spread = rows[sound], spread[sound]
    return Observed(rows[:, 0].astype(np.int64), rows[:, 1:5].copy(), spread, rows[:, 5].copy(), len(tracks) - len(rows))


@kernel()
def _spreads(rows: F64, covariance: F64) -> tuple[Mask, F64]:
    """Return which tracks are finite, shape (n,), and the variances of position, covariances, variances of velocity, (n, 3)."""
    sound, spread = np.empty(len(rows), np.bool_), np.empty((len(rows), 3))
    for i in range(len(rows)):
        sound[i] = np.isfinite(rows[i]).all() and np.isfinite(covariance[i]).all()
        c = covariance[i]
        position, velocity = max(0.5 * (c[0, 0] + c[1, 1]), 0.0), max(0.5 * (c[2, 2] + c[3, 3]), 0.0)
        limit = np.sqrt(position * velocity)
        spread[i] = position, min(max(0.5 * (c[0, 2] + c[1, 3]), -limit), limit), velocity
    return sound, spread


def nobody() -> Observed:
    """Return no obstacle."""
    return observed(())
