"""The hyper-graph of a timed elastic band: every penalty with its derivatives; arrays in, arrays out.

Source: Roesmann, Feiten, Woesch, Hoffmann, Bertram, Trajectory modification considering dynamic constraints of autonomous
robots, ROBOTIK 2012; the same, Efficient trajectory optimization using a sparse model, ECMR 2013.

A band is n poses, shape (n, 3), and the times between them, shape (n - 1,).  Its first and last pose are fixed.  Unknown 4 i is
the time after pose i, unknowns 4 i - 3 to 4 i - 1 are pose i itself; no penalty joins unknowns more than BANDWIDTH apart.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from estimators.field_query import bilinear_gradient

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


class Segments(NamedTuple):
    """What happens between a pose and the next, with derivatives by both poses and the time, in the order of `unknowns`."""

    forward: F64  # (n - 1,) [m], along the mean heading
    sideways: F64  # (n - 1,) [m]
    forward_slope: F64  # (n - 1, 7)
    sideways_slope: F64  # (n - 1, 7)
    twist: F64  # (n - 1, 2) [m/s, rad/s]
    twist_slope: F64  # (n - 1, 2, 7)
    unknowns: Indices  # (n - 1, 7); below 0: fixed


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def wrapped(angle: float) -> float:
    """Return the same angle between -pi and pi."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def beyond(value: float, low: float, high: float) -> tuple[float, float]:
    """Return by how much a value is outside of an interval, and the derivative of that."""
    if value > high:
        return value - high, 1.0
    if value < low:
        return low - value, -1.0
    return 0.0, 0.0


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
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


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
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


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def segments_of(poses: F64, times: F64) -> Segments:
    """Return every segment of a band."""
    n = len(times)
    forward, sideways, twist = np.empty(n), np.empty(n), np.empty((n, 2))
    forward_slope, sideways_slope, twist_slope = np.zeros((n, 7)), np.zeros((n, 7)), np.zeros((n, 2, 7))
    unknowns = np.full((n, 7), -1)
    for i in range(n):
        dx, dy, turn = poses[i + 1, 0] - poses[i, 0], poses[i + 1, 1] - poses[i, 1], wrapped(poses[i + 1, 2] - poses[i, 2])
        middle, time = poses[i, 2] + 0.5 * turn, times[i]
        c, s = np.cos(middle), np.sin(middle)
        f, left = c * dx + s * dy, c * dy - s * dx
        forward[i], sideways[i] = f, left
        forward_slope[i, 0], forward_slope[i, 1], forward_slope[i, 3], forward_slope[i, 4] = -c, -s, c, s
        forward_slope[i, 2], forward_slope[i, 5] = 0.5 * left, 0.5 * left
        sideways_slope[i, 0], sideways_slope[i, 1], sideways_slope[i, 3], sideways_slope[i, 4] = s, -c, -s, c
        sideways_slope[i, 2], sideways_slope[i, 5] = -0.5 * f, -0.5 * f
        twist[i, 0], twist[i, 1] = f / time, turn / time
        for k in range(6):
            twist_slope[i, 0, k] = forward_slope[i, k] / time
        twist_slope[i, 0, 6] = -f / time**2
        twist_slope[i, 1, 2], twist_slope[i, 1, 5], twist_slope[i, 1, 6] = -1.0 / time, 1.0 / time, -turn / time**2
        unknowns[i, 6] = 4 * i
        for k in range(3):
            if i > 0:
                unknowns[i, k] = 4 * i - 3 + k
            if i < n - 1:
                unknowns[i, 3 + k] = 4 * i + 1 + k
    return Segments(forward, sideways, forward_slope, sideways_slope, twist, twist_slope, unknowns)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def add_motion(normal: Normal, seg: Segments, times: F64, bounds: Bounds, weights: Weights) -> float:
    """Add time, kinematics and velocities of every segment; return their cost."""
    cost, by_time, eps = 0.0, np.zeros(7), bounds.epsilon
    by_time[6] = 1.0
    for i in range(len(times)):
        at = seg.unknowns[i]
        cost += add(normal, at, by_time, 1.0, times[i], weights.time)
        cost += add(normal, at, seg.sideways_slope[i], 1.0, seg.sideways[i], weights.sideways)
        residual, sign = beyond(seg.forward[i], 0.0, np.inf)
        cost += add(normal, at, seg.forward_slope[i], sign, residual, weights.forward)
        residual, sign = beyond(seg.twist[i, 0], min(eps - bounds.reverse_m_s, 0.0), bounds.speed_m_s - eps)
        cost += add(normal, at, seg.twist_slope[i, 0], sign, residual, weights.speed)
        residual, sign = beyond(seg.twist[i, 1], eps - bounds.rate_rad_s, bounds.rate_rad_s - eps)
        cost += add(normal, at, seg.twist_slope[i, 1], sign, residual, weights.rate)
    return cost


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def add_acceleration(
    normal: Normal, seg: Segments, times: F64, ends: Ends, axis: int, limit: float, weight: float
) -> float:  # fmt: skip
    """Add the accelerations of one axis (0: speed, 1: rate) between segments and at both ends; return their cost."""
    cost, last = 0.0, len(times) - 1
    unknowns, slope = np.empty(14, np.int64), np.empty(14)
    for i in range(last):
        span = 0.5 * (times[i] + times[i + 1])
        value = (seg.twist[i + 1, axis] - seg.twist[i, axis]) / span
        residual, sign = beyond(value, -limit, limit)
        if residual == 0.0:
            continue
        for k in range(7):
            unknowns[k], unknowns[7 + k] = seg.unknowns[i, k], seg.unknowns[i + 1, k]
            slope[k], slope[7 + k] = -seg.twist_slope[i, axis, k] / span, seg.twist_slope[i + 1, axis, k] / span
        slope[6] -= 0.5 * value / span
        slope[13] -= 0.5 * value / span
        cost += add(normal, unknowns, slope, sign, residual, weight)
    now = ends.speed_m_s if axis == 0 else ends.rate_rad_s
    cost += _add_end(normal, seg, times, 0, axis, now, limit, weight)
    if ends.stops:
        cost += _add_end(normal, seg, times, last, axis, 0.0, limit, weight)
    return float(cost)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _add_end(
    normal: Normal, seg: Segments, times: F64, i: int, axis: int, other: float, limit: float, weight: float
) -> float:  # fmt: skip
    """Add the acceleration between a segment and the velocity at its end of the band; return its cost."""
    value = (seg.twist[i, axis] - other) / times[i]
    slope = seg.twist_slope[i, axis] / times[i]
    slope[6] -= value / times[i]
    residual, sign = beyond(value, -limit, limit)
    return float(add(normal, seg.unknowns[i], slope, sign, residual, weight))


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def add_standing(normal: Normal, poses: F64, scene: Scene, bounds: Bounds, weights: Weights) -> float:
    """Add the gaps of every free pose to what stands; return their cost."""
    cost, least = 0.0, bounds.least_gap_m + bounds.epsilon
    for i in range(1, len(poses) - 1):
        clearance, dx, dy = bilinear_gradient(
            scene.clearance, scene.corner_x, scene.corner_y, scene.cell_m, poses[i, 0], poses[i, 1]
        )
        gap = clearance - scene.body_m
        cost += add_at_pose(normal, i, -dx, -dy, max(least - gap, 0.0), weights.obstacle)
        cost += add_at_pose(normal, i, -dx, -dy, max(bounds.inflation_m - gap, 0.0), weights.inflation)
    return cost


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def add_moving(normal: Normal, poses: F64, passed_s: F64, scene: Scene, bounds: Bounds, weights: Weights) -> float:
    """Add the gaps of every free pose to what moves, where it is when the robot passes; return their cost."""
    cost, least = 0.0, bounds.least_gap_m + bounds.epsilon
    for i in range(1, len(poses) - 1):
        for j in range(len(scene.centre)):
            dx = poses[i, 0] - scene.centre[j, 0] - passed_s[i] * scene.velocity[j, 0]
            dy = poses[i, 1] - scene.centre[j, 1] - passed_s[i] * scene.velocity[j, 1]
            apart = max(np.hypot(dx, dy), 1e-9)
            gap = apart - scene.radius_m[j] - scene.body_m
            cost += add_at_pose(normal, i, -dx / apart, -dy / apart, max(least - gap, 0.0), weights.moving)
            residual = max(bounds.moving_inflation_m - gap, 0.0)
            cost += add_at_pose(normal, i, -dx / apart, -dy / apart, residual, weights.moving_inflation)
    return cost


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def add_via(normal: Normal, poses: F64, nearest: Indices, scene: Scene, weights: Weights) -> float:
    """Add the distances of the points to pass by to their poses, by index, shape (k,); return their cost."""
    cost = 0.0
    for k in range(len(scene.via)):
        i = nearest[k]
        if i > 0:
            cost += add_at_pose(normal, i, 1.0, 0.0, poses[i, 0] - scene.via[k, 0], weights.via)
            cost += add_at_pose(normal, i, 0.0, 1.0, poses[i, 1] - scene.via[k, 1], weights.via)
    return cost


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def nearest_poses(poses: F64, points: F64) -> Indices:
    """Return the free pose nearest to each point, shape (k,); 0, which is fixed, in a band that has none."""
    nearest = np.zeros(len(points), np.int64)
    for k in range(len(points)):
        best = np.inf
        for i in range(1, len(poses) - 1):
            apart = (poses[i, 0] - points[k, 0]) ** 2 + (poses[i, 1] - points[k, 1]) ** 2
            if apart < best:
                best, nearest[k] = apart, i
    return nearest


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def evaluated(
    poses: F64, times: F64, passed_s: F64, nearest: Indices, scene: Scene, bounds: Bounds, weights: Weights, ends: Ends,
    derive: bool,
) -> tuple[float, Normal]:  # fmt: skip
    """Return the cost of a band and Gauss-Newton's equations at it; these are empty when they are not asked for.

    When the poses are passed, shape (n,), and which are nearest to the points to pass by, shape (k,), is held fixed.
    """
    unknowns = 4 * (len(poses) - 2) + 1 if derive else 0
    normal = Normal(np.zeros((unknowns, BANDWIDTH + 1)), np.zeros(unknowns))
    seg = segments_of(poses, times)
    cost = add_motion(normal, seg, times, bounds, weights)
    cost += add_acceleration(normal, seg, times, ends, 0, bounds.acceleration_m_s2, weights.acceleration)
    cost += add_acceleration(normal, seg, times, ends, 1, bounds.acceleration_rad_s2, weights.turning)
    cost += add_standing(normal, poses, scene, bounds, weights)
    cost += add_moving(normal, poses, passed_s, scene, bounds, weights)
    cost += add_via(normal, poses, nearest, scene, weights)
    return cost, normal
