"""Layer 3 in numbers: the speed that can still be braked, and where the unknown begins on the manifold."""

from __future__ import annotations

import numpy as np
from numba import njit

from estimators.belief import F64, Mask

STRAIGHT_ON_M = 0.2  # with a miss smaller than this somebody comes straight on
CROSSING = 0.3  # the share of a velocity that leads across the way of who crosses
LED_M = 0.2  # a manifold so far aside has chosen where to pass
CHANGE_M = 0.1  # who turns out to miss by this on the other hand passes there


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
def known_way(
    known: Mask, corner: F64, cell_m: float, robot: F64, along: F64, radius_m: float, body_m: float, gap_m: float, reach_m: float
) -> float:
    """Return how far a robot may go straight on until its body meets ground that was never seen, at most `reach_m` [m].

    Args:
        known: shape (rows, columns).
        corner: lower corner of the grid in odom, shape (2,).
        cell_m: size of a cell.
        robot: in odom, shape (2,).
        along: where it goes, shape (2,), unit.
        radius_m: of the robot.
        body_m: nearer than this to its centre nothing is looked at, and it is kept from the unknown.
        gap_m: shorter stretches of unknown cells are holes.
        reach_m: how far is looked.
    """
    free, ray = reach_m, np.empty((2, 2))
    for side in range(-1, 2):
        ray[0, 0], ray[0, 1] = robot[0] - side * radius_m * along[1], robot[1] + side * radius_m * along[0]
        ray[1] = ray[0] + (reach_m + body_m + gap_m) * along
        free = min(free, known_length(known, corner, cell_m, ray, body_m, gap_m) - body_m)
    return max(free, 0.0)


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
def give_way(
    u: F64, robot: F64, closing: F64, apart_m: float, horizon_s: float, side: F64, tangent: F64, hand: float, lead_m: float = 0.0
) -> tuple[F64, float]:
    """Return the velocity nearest to u, shape (2,), with which what closes in passes at `apart_m` if it goes on as it does.

    Standing still, the robot would be missed by the signed distance m, across the other's way, after the time t of closest
    approach; with a velocity across that way of at most (m - apart) / t it is missed by enough: it does not cross in front of
    who crosses before it.  On which hand he passes is kept while he comes: a miss near zero changes its sign with the noise
    of the velocity that it follows from.

    Args:
        u: velocity in odom [m/s].
        robot: in odom, shape (2,).
        closing: middle, velocity and number of cells of the boundary, shape (5,).
        apart_m: between the middle and the robot's centre.
        horizon_s: later encounters do not count.
        side: where the manifold leads to, shape (2,), unit: the robot goes there when somebody comes straight on along the way.
        tangent: of the way, shape (2,), unit; behind who comes straight on across it, the robot passes.
        lead_m: how far the manifold is to that side: where it has gone aside, the robot goes there for who comes along the way.
        hand: on which he passes at the tick before, seen along his way: 1 left of the robot, -1 right of it; 0: nobody came.

    Returns:
        The velocity, and the hand on which he passes now.
    """
    speed2 = closing[2] * closing[2] + closing[3] * closing[3]
    if closing[4] == 0.0 or speed2 < 0.01:
        return u, 0.0
    x, y = closing[0] - robot[0], closing[1] - robot[1]
    t = -(x * closing[2] + y * closing[3]) / speed2
    if not 0.0 < t < horizon_s:
        return u, 0.0
    speed = np.sqrt(speed2)
    left_x, left_y = -closing[3] / speed, closing[2] / speed
    miss = x * left_x + y * left_y  # what is along his way is over at t
    across = tangent[0] * closing[3] - tangent[1] * closing[2]  # his speed to the left, across the way
    if lead_m > LED_M and abs(miss) < apart_m and abs(across) <= CROSSING * speed:
        hand = -1.0 if side[0] * left_x + side[1] * left_y > 0.0 else 1.0
    elif hand == 0.0 and abs(miss) < STRAIGHT_ON_M:
        if abs(across) > CROSSING * speed:
            behind = across * (tangent[0] * left_y - tangent[1] * left_x)
            hand = 1.0 if behind > 0.0 else -1.0
        else:
            hand = -1.0 if side[0] * left_x + side[1] * left_y > 0.0 else 1.0
    elif hand == 0.0 or hand * miss < -CHANGE_M:
        hand = 1.0 if miss > 0.0 else -1.0
    n_x, n_y = hand * left_x, hand * left_y
    excess = u[0] * n_x + u[1] * n_y - (hand * miss - apart_m) / max(t, 0.5)
    if excess <= 0.0:
        return u, hand
    return np.array([u[0] - excess * n_x, u[1] - excess * n_y]), hand
