"""A disc from the cells of its surface that a sensor sees: how wide it looks, and where its centre is."""

from __future__ import annotations

import math

from numba import njit

from estimators.belief import F64

ANCHOR = 0.5  # how many cells' worth the first guess counts, so that a short arc does not run away
ITERATIONS = 4


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def apparent_disc(points: F64, sensor_x: float, sensor_y: float) -> tuple[float, float, float]:
    """Return bearing [rad], nearest range [m] and radius [m] of the disc that just fills the points' extent as seen.

    Its nearest point is as near as theirs, r, and the lines of sight along its sides enclose the same angle 2 phi:
    radius = r sin(phi) / (1 - sin(phi)).  Points, shape (n, 2), in odom.
    """
    mean_x, mean_y = points[:, 0].mean() - sensor_x, points[:, 1].mean() - sensor_y
    low, high, nearest = math.inf, -math.inf, math.inf
    for x, y in points:
        along = mean_x * (x - sensor_x) + mean_y * (y - sensor_y)
        across = mean_x * (y - sensor_y) - mean_y * (x - sensor_x)
        angle = math.atan2(across, along)
        low, high = min(low, angle), max(high, angle)
        nearest = min(nearest, math.hypot(x - sensor_x, y - sensor_y))
    sine = math.sin(min(0.5 * (high - low), 1.2))
    return math.atan2(mean_y, mean_x) + 0.5 * (low + high), nearest, nearest * sine / (1.0 - sine)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def centre_of(points: F64, guess_x: float, guess_y: float, radius: float) -> tuple[float, float]:
    """Return the centre of a disc of known radius on whose edge the points lie, by Gauss-Newton from a guess beyond them."""
    x, y = guess_x, guess_y
    for _ in range(ITERATIONS):
        xx, xy, yy = ANCHOR, 0.0, ANCHOR
        gx, gy = ANCHOR * (guess_x - x), ANCHOR * (guess_y - y)
        for px, py in points:
            dx, dy = px - x, py - y
            distance = max(math.hypot(dx, dy), 1e-6)
            ux, uy, excess = dx / distance, dy / distance, distance - radius
            xx, xy, yy = xx + ux * ux, xy + ux * uy, yy + uy * uy
            gx, gy = gx + ux * excess, gy + uy * excess
        determinant = xx * yy - xy * xy
        x, y = x + (yy * gx - xy * gy) / determinant, y + (xx * gy - xy * gx) / determinant
    return x, y
