"""A timed elastic band, and how one is laid along a path or taken over from the last call."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivers.interface.geometry import wrap_angle
from estimators.belief import F64
from planners.polyline import resample

_COARSEST_TURN_RAD = 0.5  # between two poses on the spot


@dataclass(frozen=True, slots=True)
class Band:
    """Poses, and the times between them."""

    poses: F64  # (n, 3): x, y, yaw in odom
    times_s: F64  # (n - 1,)

    @property
    def passed_s(self) -> F64:
        """When each pose is passed, shape (n,)."""
        return np.concatenate(([0.0], np.cumsum(self.times_s)))

    @property
    def duration_s(self) -> float:
        """How long it takes."""
        return float(self.times_s.sum())

    @property
    def first_twist(self) -> tuple[float, float]:
        """Speed [m/s] and rate [rad/s] from the first pose to the second."""
        (x, y, yaw), (x1, y1, yaw1) = self.poses[0].tolist(), self.poses[1].tolist()
        turn, time_s = wrap_angle(yaw1 - yaw), float(self.times_s[0])
        middle = yaw + 0.5 * turn
        return (math.cos(middle) * (x1 - x) + math.sin(middle) * (y1 - y)) / time_s, turn / time_s


def tangents(path: F64) -> F64:
    """Return the direction of the path at each of its points, shape (n,); at the last one that of the last step."""
    steps = np.diff(path, axis=0)
    yaw = np.arctan2(steps[:, 1], steps[:, 0])
    return np.concatenate((yaw, yaw[-1:]))


def laid_along(path: F64, yaw: float, end_yaw: float, speed_m_s: float, rate_rad_s: float, step_s: float) -> Band:
    """Return a band along a path, shape (m, 2), at the caps; it turns on the spot to face it where it begins elsewhere.

    Args:
        path: shape (m, 2), m >= 2.
        yaw: of the robot at its start.
        end_yaw: at its end.
        speed_m_s: cap.
        rate_rad_s: cap.
        step_s: between poses.
    """
    points = resample(path, speed_m_s * step_s)
    along = np.column_stack((points, tangents(points)))
    along[-1, 2] = end_yaw
    turn = wrap_angle(float(along[0, 2]) - yaw)
    turns = math.ceil(abs(turn) / max(rate_rad_s * step_s, _COARSEST_TURN_RAD)) if len(points) > 1 else 0
    spot = [[points[0, 0], points[0, 1], yaw + turn * k / turns] for k in range(turns)]
    poses = np.concatenate((np.array(spot).reshape(-1, 3), along)) if turns else along
    poses[0, 2] = yaw
    moved = np.hypot(*np.diff(poses[:, :2], axis=0).T) / speed_m_s
    turned = np.abs((np.diff(poses[:, 2]) + np.pi) % (2.0 * np.pi) - np.pi) / rate_rad_s
    return Band(poses, np.maximum(np.maximum(moved, turned), 0.1 * step_s))


def taken_over(band: Band, pose: F64, end: F64, period_s: float, step_s: float, speed_m_s: float) -> Band:
    """Return the last band from where the robot is now to another end, shapes (3,): poses passed are left out.

    Where the end has moved on by a step or more, it becomes a pose of its own.
    """
    poses, times = band.poses, band.times_s
    apart = np.hypot(*(poses[: max(len(poses) // 2, 1), :2] - pose[:2]).T)
    first = min(int(np.argmin(apart)), len(poses) - 2)
    poses, times = poses[first:].copy(), times[first:].copy()
    poses[0] = pose
    if first == 0:
        times[0] = max(times[0] - period_s, 0.5 * times[0])
    gap_m = math.hypot(*(end[:2] - poses[-1, :2]))
    if gap_m > 0.5 * speed_m_s * step_s:
        return Band(np.concatenate((poses, end[None])), np.append(times, gap_m / speed_m_s))
    poses[-1] = end
    return Band(poses, times)
