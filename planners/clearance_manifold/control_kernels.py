"""Layer 3 in numbers: the speed that can still be braked, and where the unknown begins on the manifold."""

from __future__ import annotations

import numpy as np
from numba import njit

from estimators.belief import F64, Mask


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def brakable(distance_m: float, deceleration_m_s2: float, delay_s: float) -> float:
    """Return the largest speed v with v delay + v^2 / (2 deceleration) <= distance [m/s].

    >>> brakable(0.25, 0.5, 0.0)
    0.5
    """
    lead = deceleration_m_s2 * delay_s
    return float(np.sqrt(lead * lead + 2.0 * deceleration_m_s2 * max(distance_m, 0.0)) - lead)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def known_length(known: Mask, corner: F64, cell_m: float, points: F64, body_m: float, gap_m: float) -> float:
    """Return how far along a curve, shape (n, 2), the first stretch of unknown cells longer than `gap_m` begins [m].

    The first `body_m` of the curve are not looked at; off the grid nothing is known.
    """
    along, seen_to, unknown_since, step = 0.0, 0.0, np.inf, 0.5 * cell_m
    rows, columns = known.shape
    for i in range(len(points) - 1):
        dx, dy = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        length = np.hypot(dx, dy)
        pieces = max(1, int(np.ceil(length / step)))
        for k in range(pieces):
            x, y = points[i, 0] + dx * k / pieces, points[i, 1] + dy * k / pieces
            here = along + length * k / pieces
            row, column = int(np.floor((y - corner[1]) / cell_m)), int(np.floor((x - corner[0]) / cell_m))
            seen = here <= body_m or (0 <= row < rows and 0 <= column < columns and known[row, column])
            if seen:
                unknown_since, seen_to = np.inf, here
            else:
                unknown_since = min(unknown_since, seen_to)
                if here - unknown_since >= gap_m:
                    return float(unknown_since)
        along += length
    return float(min(along, unknown_since))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def longitudinal(u_x: float, u_y: float, t_x: float, t_y: float, speed: float, cap_x: float, cap_y: float, low_x: float) -> float:
    """Return the largest k <= speed for which u + k t stays inside the caps; 0 where none above it does."""
    k = speed
    if t_x > 1e-9:
        k = min(k, (cap_x - u_x) / t_x)
    elif t_x < -1e-9:
        k = min(k, (low_x - u_x) / t_x)
    if t_y > 1e-9:
        k = min(k, (cap_y - u_y) / t_y)
    elif t_y < -1e-9:
        k = min(k, (-cap_y - u_y) / t_y)
    return max(k, 0.0)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def give_way(u: F64, robot: F64, closing: F64, apart_m: float, horizon_s: float, side: F64) -> F64:
    """Return the velocity nearest to u, shape (2,), with which what closes in passes at `apart_m` if it goes on as it does.

    Standing still, the robot would be missed by the vector m after the time t of closest approach; with u . m / |m| <=
    (|m| - apart) / t it is missed by enough: it does not cross in front of who crosses before it.

    Args:
        u: velocity in odom [m/s].
        robot: in odom, shape (2,).
        closing: middle, velocity and number of cells of the boundary, shape (5,).
        apart_m: between the middle and the robot's centre.
        horizon_s: later encounters do not count.
        side: where to go when it comes straight on, shape (2,), unit.
    """
    speed2 = closing[2] * closing[2] + closing[3] * closing[3]
    if closing[4] == 0.0 or speed2 < 0.01:
        return u
    x, y = closing[0] - robot[0], closing[1] - robot[1]
    t = -(x * closing[2] + y * closing[3]) / speed2
    if not 0.0 < t < horizon_s:
        return u
    miss_x, miss_y = x + closing[2] * t, y + closing[3] * t
    miss = np.hypot(miss_x, miss_y)
    if miss < 0.1:
        miss_x, miss_y = -side[0], -side[1]
        length = 1.0
    else:
        length = miss
    n_x, n_y = miss_x / length, miss_y / length
    excess = u[0] * n_x + u[1] * n_y - (miss - apart_m) / max(t, 0.5)
    if excess <= 0.0:
        return u
    return np.array([u[0] - excess * n_x, u[1] - excess * n_y])
