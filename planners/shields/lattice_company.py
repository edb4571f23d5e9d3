"""Where those who move will be at the looks of a rollout, one row for each way in which one may go on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimators.belief import F64, Track
from planners.prediction.walls import Walls, keep_out

F32 = NDArray[np.float32]
_STOPPED = 0.5  # of the way that he would make
Setting = tuple[tuple[Track, tuple[float, float]], ...]  # who may set off, and how


def with_resters(moving: tuple[Track, ...], resting: Setting) -> tuple[Track, ...]:
    """Return who moves and who may."""
    known = {track.identity for track in moving}
    return (*moving, *(track for track, _ in resting if track.identity not in known))


def futures(moving: tuple[Track, ...], resting: Setting, times_s: F64, walls: Walls) -> tuple[F32, F64]:
    """Return places, shape (times, n, 2), and radii, (n,): everybody as tracked, and who may set off as he came.

    Nobody goes through what stands still; who would have to, to go on as he came, turns back.  Tracks that are not finite are
    left out.

    Args:
        moving: all of them.
        resting: those of them that may set off.
        times_s: so near to each other that nobody is past a wall from one to the next but one, shape (times,).
        walls: without the cells of those who move.
    """
    rows = _rows([(track, track.velocity_in_odom) for track in moving], resting, [(one, (-x, -y)) for one, (x, y) in resting])
    where = (rows[:, :2] + times_s[:, None, None] * rows[:, 2:4]).astype(np.float32)
    keep_out(where[..., None], rows[:, 4].copy(), walls)
    if resting:
        on, back = slice(-2 * len(resting), -len(resting)), slice(-len(resting), None)
        made_m, meant_m = np.linalg.norm(where[-1, on] - where[0, on], axis=1), np.hypot(*rows[on, 2:4].T) * times_s[-1]
        stopped = made_m < _STOPPED * meant_m
        where[:, on] = np.where(stopped[:, None], where[:, back], where[:, on])
        where, rows = where[:, : -len(resting)].copy(), rows[: -len(resting)]
    return where, rows[:, 4].copy()


def _rows(*ways: Sequence[tuple[Track, tuple[float, float]]]) -> F64:
    """Return x, y, vx, vy and radius of every way that is finite, shape (n, 5)."""
    rows = [(*track.position_in_odom, *velocity, track.radius_m) for some in ways for track, velocity in some]
    table: F64 = np.array(rows, np.float64).reshape(-1, 5)
    sound: F64 = table[np.isfinite(table).all(axis=1)]
    return sound
