"""The hyper-graph of a timed elastic band: what it is drawn through, what it is to keep, and how a penalty is added up.

Source: Roesmann, Feiten, Woesch, Hoffmann, Bertram, Trajectory modification considering dynamic constraints of autonomous
robots, ROBOTIK 2012; the same, Efficient trajectory optimization using a sparse model, ECMR 2013.

A band is n poses, shape (n, 3), and the times between them, shape (n - 1,).  Its first and last pose are fixed.  Unknown 4 i is
the time after pose i, unknowns 4 i - 3 to 4 i - 1 are pose i itself; no penalty joins unknowns more than BANDWIDTH apart.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F64 = NDArray[np.float64]
Indices = NDArray[np.int64]

BANDWIDTH = 10


class Scene(NamedTuple):
    """What the band is drawn through; odom frame."""

    clearance: NDArray[np.float32]  # (rows, columns) [m], of the robot's centre
    corner_x: float
    corner_y: float
    cell_m: float
    body_m: float  # the robot's radius
    centre: F64  # (m, 2), of discs that move
    velocity: F64  # (m, 2)
    radius_m: F64  # (m,)
    via: F64  # (k, 2), points to pass by


class Bounds(NamedTuple):
    """What the penalties enforce."""

    speed_m_s: float
    reverse_m_s: float
    rate_rad_s: float
    acceleration_m_s2: float
    acceleration_rad_s2: float
    least_gap_m: float  # to what stands and moves
    inflation_m: float  # a smaller gap costs a little
    moving_inflation_m: float
    epsilon: float  # inside of a bound where its penalty begins


class Weights(NamedTuple):
    """Of the squared penalties."""

    time: float
    sideways: float
    forward: float
    speed: float
    rate: float
    acceleration: float
    turning: float  # angular acceleration
    obstacle: float
    inflation: float
    moving: float
    moving_inflation: float
    via: float


class Ends(NamedTuple):
    """How the robot moves at the band's ends."""

    speed_m_s: float
    rate_rad_s: float
    stops: bool  # at the end; else it may pass through


class Normal(NamedTuple):
    """Gauss-Newton's equations, added up penalty by penalty."""

    matrix: F64  # (unknowns, BANDWIDTH + 1): element (i, k) couples unknowns i and i - k
    gradient: F64  # (unknowns,), of half the cost


@kernel()
def beyond(value: float, low: float, high: float) -> tuple[float, float]:
    """Return by how much a value is outside of an interval, and the derivative of that."""
    if value > high:
        return value - high, 1.0
    if value < low:
        return low - value, -1.0
    return 0.0, 0.0


@kernel()
def add(normal: Normal, unknowns: Indices, slope: F64, sign: float, residual: float, weight: float) -> float:
    """Add a penalty, with `sign` times its derivatives by some unknowns, shapes (k,), to the equations; return its cost."""
    if residual == 0.0 or weight == 0.0:
        return 0.0
    if len(normal.gradient) > 0:
        for p in range(len(unknowns)):
            i = unknowns[p]
            if i < 0 or slope[p] == 0.0:
                continue
            normal.gradient[i] += weight * sign * slope[p] * residual
            for q in range(len(unknowns)):
                if 0 <= unknowns[q] <= i:
                    normal.matrix[i, i - unknowns[q]] += weight * slope[p] * slope[q]
    return weight * residual * residual


@kernel()
def add_at_pose(normal: Normal, i: int, slope_x: float, slope_y: float, residual: float, weight: float) -> float:
    """Add a penalty of where pose i is, with its derivatives by x and y; return its cost."""
    if residual == 0.0 or weight == 0.0:
        return 0.0
    if len(normal.gradient) > 0:
        x, y = 4 * i - 3, 4 * i - 2
        normal.gradient[x] += weight * slope_x * residual
        normal.gradient[y] += weight * slope_y * residual
        normal.matrix[x, 0] += weight * slope_x * slope_x
        normal.matrix[y, 0] += weight * slope_y * slope_y
        normal.matrix[y, 1] += weight * slope_x * slope_y
    return weight * residual * residual
