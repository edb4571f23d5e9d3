"""Where those who move will be at the looks of a rollout, one row for each way in which one may go on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimators.belief import F64, Track
from planners.prediction.walls import Walls, keep_out

F32 = NDArray[np.float32]
Setting = tuple[tuple[Track, tuple[float, float]], ...]  # who may set off, and how


def with_resters(moving: tuple[Track, ...], resting: Setting) -> tuple[Track, ...]:
    """Return who moves and who may."""
    known = {track.identity for track in moving}
    return (*moving, *(track for track, _ in resting if track.identity not in known))


def futures(moving: tuple[Track, ...], resting: Setting, times_s: F64, walls: Walls) -> tuple[F32, F64]:
    """Return places, shape (looks, n, 2), and radii, (n,): everybody as tracked, and who may set off as he came.

    Nobody goes through what stands still; tracks that are not finite are left out.

    Args:
        moving: all of them.
        resting: those of them that may set off.
        times_s: of the looks, shape (looks,).
        walls: without the cells of those who move.
    """
    ways = [(track, track.velocity_in_odom) for track in moving]
    rows = np.array([(*track.position_in_odom, *velocity, track.radius_m) for track, velocity in (*ways, *resting)])
    rows = rows.reshape(-1, 5)
    rows = rows[np.isfinite(rows).all(axis=1)]
    where = (rows[:, :2] + times_s[:, None, None] * rows[:, 2:4]).astype(np.float32)
    keep_out(where[..., None], rows[:, 4].copy(), walls)
    return where, rows[:, 4]
