"""The outline of a surface as the sensor sees it: which of its two sides are its own, and which only the end of what is in view.

Beside an own side the sensor sees past: there is free ground.  Beside the other there is nothing that was seen, or something that
stands before; whatever is behind may be as wide as it likes.  An own side moves as its thing does; the other stays with what
hides it, so that a centre taken from both would move at half the speed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from drivers.interface.kernel import kernel
from estimators.belief import F64, FREE, U8

ANCHOR = 0.5  # how many cells' worth the first guess counts, so that a short arc does not run away
TANGENT = 4.0  # likewise an own side
ITERATIONS = 4
SEEN_MIN = 2  # free looks beside a side, of 15


class Outline(NamedTuple):
    """Where in odom [m] the sensor stood, bearings [rad] in odom and ranges [m] from there."""

    sensor_x: float
    sensor_y: float
    right_rad: float
    left_rad: float  # at least right_rad
    nearest_m: float
    right_own: bool
    left_own: bool

    @property
    def whole(self) -> bool:
        """Whether nothing of the thing is hidden."""
        return self.right_own and self.left_own


@kernel()
def outline_of(points: F64, sensor_x: float, sensor_y: float, label: U8, x_m: float, y_m: float, cell_m: float) -> Outline:
    """Return the outline of a surface.

    Args:
        points: centres of its cells, in odom, shape (n, 2).
        sensor_x: in odom.
        sensor_y: likewise.
        label: of the frame that shows it, shape (rows, columns).
        x_m: lower corner of the labels in odom.
        y_m: likewise.
        cell_m: their side.
    """
    mean_x, mean_y = points[:, 0].mean() - sensor_x, points[:, 1].mean() - sensor_y
    middle = math.atan2(mean_y, mean_x)
    low, high, nearest, low_m, high_m = math.inf, -math.inf, math.inf, 0.0, 0.0
    for x, y in points:
        along = mean_x * (x - sensor_x) + mean_y * (y - sensor_y)
        across = mean_x * (y - sensor_y) - mean_y * (x - sensor_x)
        angle, away = math.atan2(across, along), math.hypot(x - sensor_x, y - sensor_y)
        if angle < low:
            low, low_m = angle, away
        if angle > high:
            high, high_m = angle, away
        nearest = min(nearest, away)
    corner_x, corner_y = (sensor_x - x_m) / cell_m, (sensor_y - y_m) / cell_m
    right = _sees_past(label, corner_x, corner_y, middle + low, low_m / cell_m, -1.0)
    left = _sees_past(label, corner_x, corner_y, middle + high, high_m / cell_m, 1.0)
    return Outline(sensor_x, sensor_y, middle + low, middle + high, nearest, right, left)


@kernel()
def _sees_past(label: U8, x: float, y: float, bearing: float, away: float, sign: float) -> bool:
    """Tell whether there is free ground beside a cell, at its distance from the sensor; lengths in cells."""
    count = 0
    for half_steps in range(3, 8):
        angle = bearing + sign * 0.5 * half_steps / away
        for step in range(-1, 2):
            row, column = int(y + (away + step) * math.sin(angle)), int(x + (away + step) * math.cos(angle))
            if 0 <= row < label.shape[0] and 0 <= column < label.shape[1] and label[row, column] == FREE:
                count += 1
    return count >= SEEN_MIN


def apparent_radius_m(seen: Outline) -> float:
    """Return the radius [m] of the disc that just fills an outline.

    Its nearest point is as near, r, and the lines of sight along its sides enclose the same angle 2 phi:
    radius = r sin(phi) / (1 - sin(phi)).
    """
    sine = math.sin(min(0.5 * (seen.left_rad - seen.right_rad), 1.2))
    return seen.nearest_m * sine / (1.0 - sine)


@kernel()
def bearing_of(seen: Outline, radius: float) -> float:
    """Return in which direction [rad] the centre of a disc of a radius [m] lies: beside its one own side, else in the middle."""
    if seen.right_own == seen.left_own:
        return 0.5 * (seen.right_rad + seen.left_rad)
    half: float = math.asin(radius / (seen.nearest_m + radius))
    return seen.right_rad + half if seen.right_own else seen.left_rad - half


@kernel()
def centre_of(points: F64, seen: Outline, radius: float) -> tuple[float, float]:
    """Return the centre of a disc of known radius [m] whose edge the points, shape (n, 2), lie on, and which its own sides touch.

    By Gauss-Newton, from a guess behind the points.
    """
    bearing, far = bearing_of(seen, radius), seen.nearest_m + radius
    guess_x, guess_y = seen.sensor_x + far * math.cos(bearing), seen.sensor_y + far * math.sin(bearing)
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
        for side in range(2):
            if not (seen.left_own if side else seen.right_own):
                continue
            angle = seen.left_rad if side else seen.right_rad
            inwards = -1.0 if side else 1.0
            nx, ny = -inwards * math.sin(angle), inwards * math.cos(angle)
            lack = TANGENT * (radius - nx * (x - seen.sensor_x) - ny * (y - seen.sensor_y))
            xx, xy, yy = xx + TANGENT * nx * nx, xy + TANGENT * nx * ny, yy + TANGENT * ny * ny
            gx, gy = gx + nx * lack, gy + ny * lack
        determinant = xx * yy - xy * xy
        x, y = x + (yy * gx - xy * gy) / determinant, y + (xx * gy - xy * gx) / determinant
    return x, y
