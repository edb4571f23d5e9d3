"""Tracks as arrays, the way predictors take them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.belief import F64, Track


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
    sound = np.isfinite(rows).all(axis=1) & np.isfinite(covariance).all(axis=(1, 2))
    rows, covariance = rows[sound], covariance[sound]
    axes = covariance[:, (0, 0, 2), (0, 2, 2)] + covariance[:, (1, 1, 3), (1, 3, 3)]
    spread = np.ascontiguousarray(0.5 * axes)
    spread[:, ::2] = np.maximum(spread[:, ::2], 0.0)
    limit = np.sqrt(spread[:, 0] * spread[:, 2])
    spread[:, 1] = np.clip(spread[:, 1], -limit, limit)
    return Observed(
        rows[:, 0].astype(np.int64), np.ascontiguousarray(rows[:, 1:5]), spread, rows[:, 5].copy(), len(tracks) - len(rows)
    )


def nobody() -> Observed:
    """Return no obstacle."""
    return observed(())
