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
    sound = [track for track in tracks if _is_finite(track)]
    state = np.array([(*track.position_in_odom, *track.velocity_in_odom) for track in sound]).reshape(-1, 4)
    covariance = np.array([track.covariance for track in sound]).reshape(-1, 4, 4)
    c = 0.5 * (covariance[:, (0, 0, 2), (0, 2, 2)] + covariance[:, (1, 1, 3), (1, 3, 3)])
    c[:, (0, 2)] = np.maximum(c[:, (0, 2)], 0.0)
    limit = np.sqrt(c[:, 0] * c[:, 2])
    c[:, 1] = np.clip(c[:, 1], -limit, limit)
    return Observed(
        identity=np.array([track.identity for track in sound], np.int64),
        state=state,
        spread=c,
        radius_m=np.array([track.radius_m for track in sound], np.float64),
        left_out=len(tracks) - len(sound),
    )


def nobody() -> Observed:
    """Return no obstacle."""
    return observed(())


def _is_finite(track: Track) -> bool:
    numbers = (*track.position_in_odom, *track.velocity_in_odom, track.radius_m)
    return bool(np.isfinite(numbers).all() and np.isfinite(track.covariance).all())
