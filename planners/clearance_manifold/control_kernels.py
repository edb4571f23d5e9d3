"""Layer 3 in numbers: the speed that can still be braked, and where the unknown begins on the manifold."""

from __future__ import annotations

import numpy as np

from drivers.interface.kernel import kernel
from estimators.belief import F64, Mask


@kernel()
def brakable(distance_m: float, deceleration_m_s2: float, delay_s: float) -> float:
    """Return the largest speed v with v delay + v^2 / (2 deceleration) <= distance [m/s].

    >>> brakable(0.25, 0.5, 0.0)
    0.5
    """
    lead = deceleration_m_s2 * delay_s
    return float(np.sqrt(lead * lead + 2.0 * deceleration_m_s2 * max(distance_m, 0.0)) - lead)


@kernel()
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


@kernel()
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


@kernel()
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
