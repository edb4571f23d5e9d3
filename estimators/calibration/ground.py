"""The ground in depth images: what a camera that stands says of its own height, pitch and roll.

The ground is looked for in inverse depth, where the noise of a stereo camera is the same everywhere (Gallup et al., Variable
baseline/resolution stereo, CVPR 2008, section 2) and where a plane is linear: with the ray r = (x, y, 1) of a pixel, the unit
vector u that points up and the camera's height h, a point of the ground has u.(z r) = -h, so 1/z = -(u.r)/h.  First it is found
by random triples of points (Fischler, Bolles, Random sample consensus, 1981), then fitted by robust least squares.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import BODY_FROM_OPTICAL, SE3
from drivers.interface.samples import DepthFrame
from drivers.interface.seeds import stream
from estimators.belief import F64
from estimators.calibration.identify import ROBUST, Identified, Unknown, identify

TRIPLES = 1000
POINTS_PER_FRAME = 1500
FAR_M = 4.0  # farther points are noisy, and near the end of the range only those are seen that seem nearer than they are
NEAR_M = 0.02  # a point of the ground is no farther from the plane
GATE, ROUNDS, LEAST_NOISE_PER_M = 3.0, 10, 1e-4
BELOW_M, BELOW_SHARE = 0.08, 0.01  # of all points: nothing lies below the ground
LEAST_SHARE = 0.05  # of all points: less ground is none
LEAST_REACH = 1.25  # depth of the farther ground over that of the nearer: a narrow strip at a wall's foot has no tilt of its own
LARGEST_TILT_RAD = 0.5  # between what the configuration says and what is so
HEIGHT_STD_M, ANGLE_STD_RAD = 0.01, 0.005  # what is worse determined is not used
FLATNESS = (0.0005, 0.0005, 0.0005)  # m, rad, rad: no floor is flatter, however many its points


@dataclass(frozen=True, slots=True)
class CameraCalibration:
    """Height, pitch and roll of the camera's body (x forward, y left, z up) in base."""

    found: tuple[Identified, ...]  # z_m, pitch_rad, roll_rad
    residual_m: float  # RMS of the ground's points about their plane
    ground_share: float  # of all points that were looked at
    frames: int

    @property
    def values(self) -> dict[str, float]:
        """What was found, by the names that a camera's settings have for it."""
        return {parameter.unknown.name: parameter.value for parameter in self.found}


def calibrate_camera(frames: Sequence[DepthFrame]) -> CameraCalibration:
    """Identify the mounting of a camera from frames that it took while it stood.

    Raises:
        ConfigurationError: no ground is visible, or too little of it to determine a parameter (named).
    """
    parts = [_points(frame) for frame in frames]
    rays, depth_m = np.concatenate([r for r, _ in parts]), np.concatenate([z for _, z in parts])  # (n, 3), (n,)
    if len(depth_m) < 100:
        raise _no_ground(f"{len(depth_m)} pixels of {len(frames)} frames have a depth")
    height_m, pitch, roll = mounting_of(frames[0].base_from_optical)
    near, noise = _ground(_consensus(rays, depth_m, _up(pitch, roll)), rays, depth_m)
    if not near.any() or np.divide(*np.quantile(depth_m[near], (0.9, 0.1))) < LEAST_REACH:
        raise _no_ground("what there is of it is a narrow strip")
    unknowns = (
        Unknown("z_m", "m", height_m, 0.1, HEIGHT_STD_M),
        Unknown("pitch_rad", "rad", pitch, 0.1, ANGLE_STD_RAD),
        Unknown("roll_rad", "rad", roll, 0.1, ANGLE_STD_RAD),
    )
    rays, depth_m, all_points = rays[near], depth_m[near], len(depth_m)

    def wrong(values: F64) -> F64:
        return np.asarray(rays @ (-_up(values[1], values[2]) / values[0]) - 1.0 / depth_m)

    found = _no_better_than_floors(identify(unknowns, lambda values: wrong(values) / noise))
    plane = -_up(found[1].value, found[2].value) / found[0].value
    residual_m = float(np.sqrt(np.mean(_above(plane, rays, depth_m) ** 2)))
    return CameraCalibration(found, residual_m, len(depth_m) / all_points, len(frames))


def mounting_of(base_from_optical: SE3) -> tuple[float, float, float]:
    """Return height [m], pitch and roll [rad] of the camera's body."""
    body = base_from_optical.rotation @ BODY_FROM_OPTICAL.rotation.T
    return float(base_from_optical.z), -math.asin(float(np.clip(body[2, 0], -1.0, 1.0))), math.atan2(body[2, 1], body[2, 2])


def _up(pitch: float, roll: float) -> F64:
    """Return the direction upwards in the optical frame, shape (3,)."""
    body = np.array((-math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)))
    return np.asarray(BODY_FROM_OPTICAL.rotation.T @ body)


def _points(frame: DepthFrame) -> tuple[F64, F64]:
    """Return rays, shape (n, 3), and depths [m], shape (n,), of pixels evenly over the image that have a depth."""
    k = frame.intrinsics
    stride = max(1, math.isqrt(k.width * k.height // POINTS_PER_FRAME))
    v, u = np.mgrid[stride // 2 : k.height : stride, stride // 2 : k.width : stride]
    counts = frame.depth[v, u]
    use = (counts > 0) & (counts * frame.depth_unit_m <= FAR_M)
    rays = np.stack(((u - k.cx) / k.fx, (v - k.cy) / k.fy, np.ones(u.shape)), axis=-1)[use]
    return rays, counts[use] * frame.depth_unit_m


def _consensus(rays: F64, depth_m: F64, expected_up: F64) -> F64:
    """Return the plane that most points lie on and hardly any below, as -up over height [1/m], shape (3,)."""
    random = stream(0, "calibration.ground")
    picked = random.integers(0, len(depth_m), (TRIPLES, 3))
    corners = rays[picked]  # (triples, 3, 3)
    corners, picked = (array[np.abs(np.linalg.det(corners)) > 1e-6] for array in (corners, picked))
    planes = np.linalg.solve(corners, (1.0 / depth_m[picked])[..., None])[..., 0]  # (triples, 3)
    length = np.linalg.norm(planes, axis=1)
    upright = -planes @ expected_up >= math.cos(LARGEST_TILT_RAD) * length
    best, most = None, LEAST_SHARE * len(depth_m)
    for plane in planes[upright & (length > 0.1)]:
        above = _above(plane, rays, depth_m)
        on = int(np.count_nonzero(np.abs(above) <= NEAR_M))
        if on > most and np.count_nonzero(above < -BELOW_M) <= BELOW_SHARE * len(depth_m):
            best, most = plane, on
    if best is None:
        raise _no_ground("there is no level surface below the camera that nothing lies beneath")
    return np.asarray(best)


def _ground(plane: F64, rays: F64, depth_m: F64) -> tuple[NDArray[np.bool_], float]:
    """Return which points belong to the ground, shape (n,), and the noise of their inverse depth [1/m]."""
    near, noise = np.abs(_above(plane, rays, depth_m)) <= NEAR_M, LEAST_NOISE_PER_M
    for _ in range(ROUNDS):  # what is near widens to the noise that it shows itself, and its plane moves into its middle
        plane = np.asarray(np.linalg.lstsq(rays[near], 1.0 / depth_m[near], rcond=None)[0], dtype=np.float64)
        wrong = np.abs(rays @ plane - 1.0 / depth_m)
        noise = max(LEAST_NOISE_PER_M, ROBUST * float(np.median(wrong[near])))
        near = (wrong <= GATE * noise) & (np.abs(_above(plane, rays, depth_m)) <= 4.0 * NEAR_M)
    return near, noise


def _above(plane: F64, rays: F64, depth_m: F64) -> F64:
    """Return how high points lie above a plane [m], shape (n,)."""
    return np.asarray((1.0 - depth_m * (rays @ plane)) / np.linalg.norm(plane))


def _no_better_than_floors(found: tuple[Identified, ...]) -> tuple[Identified, ...]:
    limits = zip(found, FLATNESS, strict=True)
    return tuple(Identified(f.unknown, f.value, math.hypot(f.std, least)) for f, least in limits)


def _no_ground(because: str) -> ConfigurationError:
    return ConfigurationError(
        f"calibration: no ground is visible ({because}); point the camera at free floor, at least 1 m of it, and check "
        "what the configuration says of its mounting: it must be right within 30 degrees"
    )
