"""Pictures of marker plates: the printed pattern, laid into a grey image where a pinhole camera sees it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.interface.marker_detector import dictionary_of
from drivers.interface.samples import Intrinsics
from sim_drivers.scene import MarkerPlate

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

MODULE_PX = 16  # of the texture
MARGIN_MODULES = 1  # white paper around the black square
SUPERSAMPLING = 4  # per axis: a pixel gathers light from all of its area
NEAREST_M = 0.02  # what reaches nearer to the lens is not drawn
FLUSH_M = 0.01  # a plate is stuck on a surface that is seen in its place


@dataclass(frozen=True, slots=True)
class Print:
    """A plate's picture: grey and opacity."""

    texture: F32  # (size, size, 2), both 0 to 1
    side_m: float  # with its margin
    plane_from_texture: F64  # (3, 3): a texture's pixel to x, y [m] on the plate


def print_of(plate: MarkerPlate) -> Print:
    """Print a plate."""
    dictionary = dictionary_of(plate.dictionary)
    modules = dictionary.markerSize + 2  # the code and its black border
    marker = cv2.aruco.generateImageMarker(dictionary, plate.identity, modules * MODULE_PX)
    grey = cv2.copyMakeBorder(marker, *(MARGIN_MODULES * MODULE_PX,) * 4, cv2.BORDER_CONSTANT, value=255)
    texture = np.stack((grey / 255.0, np.ones(grey.shape)), axis=-1).astype(np.float32)
    side_m = plate.side_m * (modules + 2 * MARGIN_MODULES) / modules
    pixel_m, corner_m = side_m / len(grey), 0.5 * side_m
    first_m = 0.5 * pixel_m - corner_m  # the centre of the first pixel
    return Print(texture, side_m, np.array([[pixel_m, 0.0, first_m], [0.0, -pixel_m, -first_m], [0.0, 0.0, 1.0]]))


def draw_plate(image: F32, depth_m: F32, picture: Print, rotation: F64, translation: F64, k: Intrinsics) -> None:
    """Lay a plate into an image; what stands before it covers it.

    Args:
        image: grey, 0 to 1, (height, width); changed in place.
        depth_m: along the optical axis, of everything that is there, (height, width).
        picture: what is printed on the plate.
        rotation: optical frame from the marker's, (3, 3).
        translation: of the marker's origin in the optical frame, (3,) [m].
        k: of the image.
    """
    half_m = 0.5 * picture.side_m
    corners = (
        np.array([(-half_m, half_m), (half_m, half_m), (half_m, -half_m), (-half_m, -half_m)]) @ rotation[:, :2].T + translation
    )
    if rotation[:, 2] @ translation >= 0.0 or corners[:, 2].min() < NEAREST_M:
        return
    projection = np.array([[k.fx, 0.0, k.cx], [0.0, k.fy, k.cy], [0.0, 0.0, 1.0]])
    seen = corners @ projection.T
    low = np.maximum(np.floor((seen[:, :2] / seen[:, 2:]).min(axis=0)).astype(int), 0)  # (2,): u, v
    high = np.minimum(np.ceil((seen[:, :2] / seen[:, 2:]).max(axis=0)).astype(int) + 1, (k.width, k.height))
    if (high <= low).any():
        return
    window = np.s_[low[1] : high[1], low[0] : high[0]]
    image_from_plane = projection @ np.column_stack((rotation[:, :2], translation))
    shown = _warped(picture, _finer(low) @ image_from_plane @ picture.plane_from_texture, high - low)
    shown *= _unhidden(depth_m[window], rotation[:, 2], translation, k, low)[..., None]
    image[window] = image[window] * (1.0 - shown[..., 1]) + shown[..., 0]


def _finer(low: NDArray[np.intp]) -> F64:
    """Return what takes pixels of the image, shape (3, 3), to those of the supersampled window that begins at `low`."""
    u, v = low.tolist()
    between = 0.5 * (SUPERSAMPLING - 1)
    return np.array(
        [
            [SUPERSAMPLING, 0.0, between - SUPERSAMPLING * u],
            [0.0, SUPERSAMPLING, between - SUPERSAMPLING * v],
            [0.0, 0.0, 1.0],
        ]
    )


def _warped(picture: Print, homography: F64, size: NDArray[np.intp]) -> F32:
    """Return grey times opacity and opacity, shape (height, width, 2)."""
    width, height = size.tolist()
    fine = cv2.warpPerspective(picture.texture, homography, (SUPERSAMPLING * width, SUPERSAMPLING * height))
    return np.asarray(cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA), dtype=np.float32)


def _unhidden(depth_m: F32, normal: F64, point: F64, k: Intrinsics, low: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Return, shape (height, width), where nothing stands before the plane through a point."""
    v, u = np.indices(depth_m.shape)
    ray = ((u + low[0] - k.cx) / k.fx, (v + low[1] - k.cy) / k.fy)
    facing = normal[0] * ray[0] + normal[1] * ray[1] + normal[2]
    return np.asarray((facing < 0.0) & (normal @ point > (depth_m + FLUSH_M) * facing))
