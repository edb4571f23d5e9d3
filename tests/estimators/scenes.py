"""Analytic scenes for a depth camera, and the inputs of an estimator around them."""

import math
from dataclasses import dataclass

import numpy as np

from drivers.interface.geometry import BODY_FROM_OPTICAL, SE2, SE3
from drivers.interface.mission import Mission
from drivers.interface.samples import DepthFrame, Intrinsics, Stamp, WheelSample, frozen_array
from drivers.interface.sensed import Sensed, Tick

MS = 1_000_000
ORIGIN = SE2()
SMALL = Intrinsics(160, 90, 82.0, 82.0, 81.4, 45.1)


def level_camera(height_m: float = 0.4, pitch_rad: float = 0.0, roll_rad: float = 0.0, x_m: float = 0.0) -> SE3:
    return SE3.from_euler(x_m, 0.0, height_m, roll_rad, pitch_rad, 0.0) @ BODY_FROM_OPTICAL


@dataclass(frozen=True)
class Wall:
    """The vertical plane at distance `offset_m` from the origin of odom, seen along its normal's bearing."""

    bearing_rad: float
    offset_m: float

    def depth(self, origin, rays):
        normal = np.array([math.cos(self.bearing_rad), math.sin(self.bearing_rad), 0.0])
        return _positive((self.offset_m - normal @ origin) / _not_zero(rays @ normal))


@dataclass(frozen=True)
class Pillar:
    x_m: float
    y_m: float
    radius_m: float
    top_m: float = math.inf

    def depth(self, origin, rays):
        offset = origin[:2] - [self.x_m, self.y_m]
        a = (rays[..., :2] ** 2).sum(-1)
        b, c = rays[..., :2] @ offset, offset @ offset - self.radius_m**2
        root = b * b - a * c
        near = _positive(np.where(root > 0.0, (-b - np.sqrt(np.maximum(root, 0.0))) / a, -1.0))
        height = origin[2] + np.where(np.isfinite(near), near, 0.0) * rays[..., 2]
        return np.where(height <= self.top_m, near, np.inf)


@dataclass(frozen=True)
class Floor:
    def depth(self, origin, rays):
        return _positive(-origin[2] / _not_zero(rays[..., 2]))


def _not_zero(values):
    return np.where(np.abs(values) < 1e-12, 1e-12, values)


def _positive(depth):
    return np.where(depth > 0.0, depth, np.inf)


def depth_image(solids, odom_from_base=ORIGIN, base_from_optical=None, k=SMALL, far_m=6.0, spoil=None):
    """The nearest depth of all solids per pixel, in millimetres; 0 beyond `far_m`.  `spoil` changes the metres before that."""
    camera = base_from_optical or level_camera()
    lifted = SE3.from_euler(odom_from_base.x, odom_from_base.y, 0.0, 0.0, 0.0, odom_from_base.yaw) @ camera
    v, u = np.mgrid[: k.height, : k.width]
    rays = np.stack(((u - k.cx) / k.fx, (v - k.cy) / k.fy, np.ones(u.shape)), axis=-1) @ lifted.rotation.T
    depth = np.full(u.shape, np.inf)
    for solid in solids:
        depth = np.minimum(depth, solid.depth(lifted.translation, rays))
    if spoil is not None:
        depth = spoil(depth)
    return np.where(depth <= far_m, np.round(depth * 1000.0), 0.0).astype(np.uint16)


def frame(solids, odom_from_base=ORIGIN, base_from_optical=None, k=SMALL, captured_ns=0, **how) -> DepthFrame:
    image = frozen_array(depth_image(solids, odom_from_base, base_from_optical, k, **how))
    return DepthFrame(Stamp(captured_ns, captured_ns, 0), image, 0.001, k, base_from_optical or level_camera())


def wheels(captured_ns, position_rad, velocity_rad_s) -> WheelSample:
    position, velocity = (np.array(values, dtype=float) for values in (position_rad, velocity_rad_s))
    return WheelSample(Stamp(captured_ns, captured_ns, 0), position, velocity)


def sensed(start_ns, index=0, *, depth=None, imu=(), base=(), joints=(), scans=(), truth=None) -> Sensed:
    tick = Tick(index, start_ns, 50 * MS)
    return Sensed(tick, depth, tuple(imu), tuple(base), tuple(joints), tuple(scans), (), truth, (), Mission(SE2(), ()))
