"""Carrot, curvature, regulation and the collision check along the arc; arrays and numbers in, arrays and numbers out.

Source: Macenski, Singh, Martin, Gines, Regulated Pure Pursuit for Robot Path Tracking, Autonomous Robots 2023, section 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.field_query import bilinear

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]


@kernel()
def carrot_on(path: F64, x: float, y: float, distance_m: float) -> tuple[float, float]:
    """Return where the path, shape (n, 2), first leaves the circle of this radius around (x, y); its end when it never does."""
    for i in range(len(path) - 1):
        ax, ay = path[i, 0] - x, path[i, 1] - y
        bx, by = path[i + 1, 0] - x, path[i + 1, 1] - y
        if np.hypot(bx, by) < distance_m:
            continue
        dx, dy = bx - ax, by - ay
        a, b, c = dx * dx + dy * dy, ax * dx + ay * dy, ax * ax + ay * ay - distance_m * distance_m
        if c >= 0.0 or a == 0.0:  # the path begins outside the circle already
            return path[i, 0], path[i, 1]
        share = (-b + np.sqrt(b * b - a * c)) / a
        return path[i, 0] + share * dx, path[i, 1] + share * dy
    return path[-1, 0], path[-1, 1]


@kernel()
def curvature_to(ahead_m: float, left_m: float) -> float:
    """Return the curvature [1/m] of the circle that leaves the robot forwards and meets a point in its frame (equation 2)."""
    squared = ahead_m * ahead_m + left_m * left_m
    return 2.0 * left_m / squared if squared > 0.001 else 0.0


@kernel()
def regulated(
    speed: float, curvature: float, clearance_m: float, radius_min_m: float, scaling_m: float, gain: float, slowest: float
) -> float:
    """Return the speed [m/s] that curve and room admit, no slower than `slowest` (section 4.2).

    A `radius_min_m` or `scaling_m` of zero switches the heuristic off.
    """
    in_curve = speed * min(1.0, 1.0 / (abs(curvature) * radius_min_m)) if abs(curvature) * radius_min_m > 1.0 else speed
    near = speed * gain * clearance_m / scaling_m if clearance_m < scaling_m else speed
    return max(min(in_curve, near), min(slowest, speed))


@kernel()
def approaching(speed: float, left_m: float, distance_m: float, scaling_m: float, slowest: float) -> float:
    """Return the speed towards the end of a path of which `left_m` is left, `distance_m` away (section 4.2)."""
    if left_m >= scaling_m:
        return speed
    return min(speed, max(speed * distance_m / scaling_m, slowest))


@kernel()
def collides_along(
    pose: F64, speed: float, turn: float, reach_m: float, time_s: float, required_m: float,
    clearance: F32, corner_x: float, corner_y: float, cell_m: float,
) -> tuple[bool, F64]:  # fmt: skip
    """Return whether the arc from the pose, shape (3,), meets a place with too little clearance, and the arc, shape (n, 2).

    It is followed a cell at a time, for `time_s` at most and no farther than `reach_m` from where it starts.
    """
    steps = int(time_s * abs(speed) / cell_m) if speed != 0.0 else 0
    arc = np.empty((steps + 1, 2))
    x, y, yaw = pose[0], pose[1], pose[2]
    arc[0] = x, y
    half_turn = 0.5 * turn * cell_m / abs(speed) if speed != 0.0 else 0.0
    chord = np.copysign(cell_m, speed) * (np.sin(half_turn) / half_turn if half_turn != 0.0 else 1.0)
    for k in range(steps):
        x, y = x + chord * np.cos(yaw + half_turn), y + chord * np.sin(yaw + half_turn)
        yaw += 2.0 * half_turn
        if np.hypot(x - pose[0], y - pose[1]) > reach_m:
            return False, arc[: k + 1]
        arc[k + 1] = x, y
        if bilinear(clearance, corner_x, corner_y, cell_m, x, y) < required_m:
            return True, arc[: k + 2]
    return False, arc
