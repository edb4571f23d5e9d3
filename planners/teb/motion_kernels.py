"""How a band moves: time, kinematics, velocities and accelerations, with their derivatives; arrays in, arrays out.

Source: Roesmann, Feiten, Woesch, Hoffmann, Bertram, Trajectory modification considering dynamic constraints of autonomous
robots, ROBOTIK 2012; the same, Efficient trajectory optimization using a sparse model, ECMR 2013.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drivers.interface.kernel import kernel
from planners.teb.graph_kernels import F64, Bounds, Ends, Indices, Normal, Weights, add, beyond


class Segments(NamedTuple):
    """What happens between a pose and the next, with derivatives by both poses and the time, in the order of `unknowns`."""

    forward: F64  # (n - 1,) [m], along the mean heading
    sideways: F64  # (n - 1,) [m]
    forward_slope: F64  # (n - 1, 7)
    sideways_slope: F64  # (n - 1, 7)
    twist: F64  # (n - 1, 2) [m/s, rad/s]
    twist_slope: F64  # (n - 1, 2, 7)
    unknowns: Indices  # (n - 1, 7); below 0: fixed


@kernel()
def wrapped(angle: float) -> float:
    """Return the same angle between -pi and pi."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


@kernel()
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


@kernel()
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


@kernel()
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


@kernel()
def _add_end(
    normal: Normal, seg: Segments, times: F64, i: int, axis: int, other: float, limit: float, weight: float
) -> float:  # fmt: skip
    """Add the acceleration between a segment and the velocity at its end of the band; return its cost."""
    value = (seg.twist[i, axis] - other) / times[i]
    slope = seg.twist_slope[i, axis] / times[i]
    slope[6] -= value / times[i]
    residual, sign = beyond(value, -limit, limit)
    return float(add(normal, seg.unknowns[i], slope, sign, residual, weight))
