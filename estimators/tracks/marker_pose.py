"""Where a square fiducial marker is, from its four corners in an image.

Source: Collins and Bartoli, Infinitesimal plane-based pose estimation (2014), which is OpenCV's SOLVEPNP_IPPE_SQUARE.  Of its two
solutions, mirrored about the line of sight, it is the one that projects onto the corners better, refined to the least squared
distance from them.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from drivers.interface.samples import Intrinsics
from estimators.belief import F64

UNDISTORTED = np.zeros(4)


@dataclass(frozen=True, slots=True)
class MarkerPose:
    """A marker in the camera's optical frame; its own axes: x right and y up as printed, z out of it."""

    rotation: F64  # (3, 3): optical from marker
    position_m: F64  # (3,)
    covariance_m2: F64  # (3, 3), of the position
    residual_px: float  # RMS distance of the corners from where the pose puts them


def marker_pose(corners_px: F64, side_m: float, intrinsics: Intrinsics, sigma_px: float) -> MarkerPose | None:
    """Return the pose of a marker; None: the corners span no area.

    Args:
        corners_px: clockwise from the top left as printed, (4, 2), finite.
        side_m: of the square.
        intrinsics: of the image.
        sigma_px: standard deviation of a corner, each axis; the covariance is what it leaves, by the projection's Jacobian.
    """
    half_m = 0.5 * side_m
    square = np.array([(-half_m, half_m, 0.0), (half_m, half_m, 0.0), (half_m, -half_m, 0.0), (-half_m, -half_m, 0.0)])
    if abs(_area_px2(corners_px)) < 1.0:
        return None
    camera = np.array([[intrinsics.fx, 0.0, intrinsics.cx], [0.0, intrinsics.fy, intrinsics.cy], [0.0, 0.0, 1.0]])
    try:
        solved, turn, place = cv2.solvePnP(square, corners_px, camera, UNDISTORTED, flags=cv2.SOLVEPNP_IPPE_SQUARE)
        if solved:
            turn, place = cv2.solvePnPRefineLM(square, corners_px, camera, UNDISTORTED, turn, place)
    except cv2.error:  # what no view of a square can look like
        return None
    if not (solved and np.isfinite(turn).all() and np.isfinite(place).all() and place[2, 0] > 0.0):
        return None
    projected, jacobian = cv2.projectPoints(square, turn, place, camera, UNDISTORTED)
    by_pose = np.asarray(jacobian, dtype=np.float64)[:, :6]  # (8, 6): rotation, translation
    information = by_pose.T @ by_pose / sigma_px**2
    if np.linalg.cond(information) > 1e16:
        return None
    covariance: F64 = np.asarray(np.linalg.inv(information)[3:, 3:], dtype=np.float64)
    residual = np.asarray(projected, dtype=np.float64).reshape(4, 2) - corners_px
    rotation = np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)
    return MarkerPose(rotation, np.asarray(place[:, 0], dtype=np.float64), covariance, float(np.sqrt((residual**2).sum() / 4)))


def _area_px2(corners_px: F64) -> float:
    (ax, ay), (bx, by) = corners_px[2] - corners_px[0], corners_px[3] - corners_px[1]
    return float(0.5 * (ax * by - ay * bx))
