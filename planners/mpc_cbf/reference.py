"""Where along the route the robot should be at every step of the prediction."""

from __future__ import annotations

import math

import numpy as np

from estimators.belief import F64
from planners.polyline import arc_length

_TANGENT_M = 0.3  # over which the route's direction is taken: a route on a grid has corners of 45 degrees


def ahead_of(position: F64, path: F64) -> F64:
    """Return the rest of a path, shape (m, 2) with m >= 2, from its point nearest to a position, shape (2,)."""
    if len(path) == 1:
        return np.concatenate((position[None], path))
    start, along = path[:-1], np.diff(path, axis=0)
    square = np.maximum(np.sum(along * along, axis=1), 1e-12)
    part = np.clip(np.sum((position - start) * along, axis=1) / square, 0.0, 1.0)
    foot = start + part[:, None] * along
    nearest = int(np.argmin(np.hypot(*(foot - position).T)))
    return np.concatenate((foot[nearest][None], path[nearest + 1 :]))


def reference(path: F64, speed_m_s: float, deceleration_m_s2: float, times_s: F64) -> tuple[F64, F64]:
    """Return x, y, yaw, shape (n, 3), and speed, shape (n,), of one that goes along the path and comes to rest at its end.

    Args:
        path: shape (m, 2), m >= 2; it starts at time 0.
        speed_m_s: cruise.
        deceleration_m_s2: at the end.
        times_s: shape (n,).
    """
    along = arc_length(path)
    length = float(along[-1])
    cruise = min(speed_m_s, math.sqrt(deceleration_m_s2 * length))  # as much to brake in as half of the way, if it is short
    braking_m = 0.5 * cruise * cruise / deceleration_m_s2
    until_s, brake_s = max(length - braking_m, 0.0) / max(cruise, 1e-9), cruise / deceleration_m_s2
    braked_s = np.clip(times_s - until_s, 0.0, brake_s)
    gone = cruise * (np.minimum(times_s, until_s) + braked_s) - 0.5 * deceleration_m_s2 * braked_s**2
    gone, speed = np.minimum(gone, length), np.where(times_s < until_s + brake_s, cruise - deceleration_m_s2 * braked_s, 0.0)
    behind, before = np.clip(gone - 0.5 * _TANGENT_M, 0.0, None), np.minimum(gone + 0.5 * _TANGENT_M, length)
    behind = np.minimum(behind, max(length - _TANGENT_M, 0.0))
    x, y = np.interp(gone, along, path[:, 0]), np.interp(gone, along, path[:, 1])
    dx = np.interp(before, along, path[:, 0]) - np.interp(behind, along, path[:, 0])
    dy = np.interp(before, along, path[:, 1]) - np.interp(behind, along, path[:, 1])
    return np.stack((x, y, np.arctan2(dy, dx)), axis=1), speed
