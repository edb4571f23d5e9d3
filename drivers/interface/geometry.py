"""Rigid transforms in the plane and in space.  Names read `odom_from_base`: it takes points in base to points in odom."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def wrap_angle(angle: float) -> float:
    """Return the angle in [-pi, pi).

    >>> round(wrap_angle(3 * math.pi / 2), 6)
    -1.570796
    """
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@dataclass(frozen=True, slots=True)
class SE2:
    """A pose or transform in the plane: x, y [m] and yaw [rad]."""

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def __matmul__(self, other: SE2) -> SE2:
        """Compose: `a_from_b @ b_from_c` is `a_from_c`."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return SE2(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            wrap_angle(self.yaw + other.yaw),
        )

    def inverse(self) -> SE2:
        """Return the transform the other way round."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return SE2(-c * self.x - s * self.y, s * self.x - c * self.y, wrap_angle(-self.yaw))

    def apply(self, points: Array) -> Array:
        """Transform points, shape (..., 2) [m]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        x, y = points[..., 0], points[..., 1]
        along = self.x + c * x - s * y
        moved = np.empty(points.shape, along.dtype)  # for a single point, stacking takes longer than the rest
        moved[..., 0], moved[..., 1] = along, self.y + s * x + c * y
        return moved

    def distance(self, other: SE2) -> float:
        """Return the distance between the two origins [m]."""
        return math.hypot(self.x - other.x, self.y - other.y)

    def integrate(self, vx: float, vy: float, wz: float, dt_s: float) -> SE2:
        """Move by a constant body twist [m/s, m/s, rad/s] for dt_s, along the exact arc (the SE(2) exponential).

        >>> turned = SE2().integrate(math.pi, 0.0, math.pi, 1.0)  # half a circle of radius 1 m
        >>> round(turned.x, 9), round(turned.y, 9)
        (0.0, 2.0)
        """
        angle = wz * dt_s
        if abs(angle) < 1e-9:
            a, b = 1.0, 0.5 * angle
        else:
            a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle
        dx, dy = vx * dt_s, vy * dt_s
        return self @ SE2(a * dx - b * dy, b * dx + a * dy, angle)


@dataclass(frozen=True, slots=True)
class SE3:
    """A transform in space: position [m] and unit quaternion (w, x, y, z)."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    qw: float = 1.0
    qx: float = 0.0
    qy: float = 0.0
    qz: float = 0.0

    @classmethod
    def from_euler(cls, x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> SE3:
        """Build from a position [m] and roll, pitch, yaw [rad] about fixed axes (REP 103: x, then y, then z)."""
        cr, sr = math.cos(roll / 2), math.sin(roll / 2)
        cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
        cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
        return cls(
            x,
            y,
            z,
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        )

    @property
    def rotation(self) -> Array:
        """The rotation matrix, shape (3, 3)."""
        w, x, y, z = self.qw, self.qx, self.qy, self.qz
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    @property
    def translation(self) -> Array:
        """The position, shape (3,) [m]."""
        return np.array([self.x, self.y, self.z])

    def __matmul__(self, other: SE3) -> SE3:
        """Compose: `a_from_b @ b_from_c` is `a_from_c`."""
        p = self.rotation @ other.translation + self.translation
        w1, x1, y1, z1 = self.qw, self.qx, self.qy, self.qz
        w2, x2, y2, z2 = other.qw, other.qx, other.qy, other.qz
        return SE3(
            float(p[0]),
            float(p[1]),
            float(p[2]),
            w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
            w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
            w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        )

    def inverse(self) -> SE3:
        """Return the transform the other way round."""
        p = -(self.rotation.T @ self.translation)
        return SE3(float(p[0]), float(p[1]), float(p[2]), self.qw, -self.qx, -self.qy, -self.qz)

    def apply(self, points: Array) -> Array:
        """Transform points, shape (..., 3) [m]."""
        return np.asarray(points @ self.rotation.T + self.translation, dtype=np.float64)


# The optical frame (x right, y down, z forward) as seen from a camera body frame (x forward, y left, z up), REP 103.
BODY_FROM_OPTICAL = SE3(0.0, 0.0, 0.0, 0.5, -0.5, 0.5, -0.5)
