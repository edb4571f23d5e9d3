"""Occupancy grid and clearance field as coloured pictures that lie in the scene; what is unknown is transparent."""

from __future__ import annotations

import cv2
import numpy as np
import rerun as rr
from numpy.typing import NDArray

from estimators.belief import FREE, OCCUPIED, ClearanceField, Lattice, OccupancyGrid

CLEARANCE_SHOWN_M = 1.5  # the last colour; further away looks the same
RATE_SHOWN_M_S, RATE_STILL_M_S = 1.0, 0.1  # the last colours; what changes more slowly is transparent
_GRID_Z_M, _CLEARANCE_Z_M, _RATE_Z_M = 0.002, 0.004, 0.006
_OPACITY = 0.99  # at 1 the viewer would not blend, and paint what is transparent black
_RGBA8 = rr.components.ImageFormat


def grid_columns(grids: list[OccupancyGrid]) -> rr.ComponentColumnList:
    """Return the pictures of grids: free is slate, occupied orange."""
    return _columns([grid.lattice for grid in grids], [_LABEL_RGBA[grid.label] for grid in grids], _GRID_Z_M)


def clearance_columns(fields: list[ClearanceField]) -> rr.ComponentColumnList:
    """Return the pictures of clearance fields: from dark (touching) to bright (`CLEARANCE_SHOWN_M` and more)."""
    pictures = []
    for field in fields:
        level = np.clip(field.clearance_m * (255.0 / CLEARANCE_SHOWN_M), 0.0, 255.0).astype(np.uint8)
        pictures.append(np.where(field.known, _CLEARANCE_RGBA[level], np.uint32(0)))
    return _columns([field.lattice for field in fields], pictures, _CLEARANCE_Z_M)


def rate_columns(fields: list[ClearanceField]) -> rr.ComponentColumnList:
    """Return the pictures of clearance rates: where it closes red, where it opens blue, where it is still nothing."""
    pictures = []
    for field in fields:
        level = np.clip(field.rate_m_s * (127.0 / RATE_SHOWN_M_S) + 128.0, 0.0, 255.0).astype(np.uint8)
        pictures.append(_RATE_RGBA[level])
    return _columns([field.lattice for field in fields], pictures, _RATE_Z_M)


def _columns(lattices: list[Lattice], pictures: list[NDArray[np.uint32]], z_m: float) -> rr.ComponentColumnList:
    return rr.GridMap.columns(
        data=[np.ascontiguousarray(picture).view(np.uint8).reshape(-1) for picture in pictures],
        format=[_RGBA8(x.columns, x.rows, color_model="RGBA", channel_datatype="U8") for x in lattices],
        cell_size=[lattice.cell_m for lattice in lattices],
        translation=[(lattice.x_m, lattice.y_m, z_m) for lattice in lattices],
        opacity=[_OPACITY] * len(lattices),
    )


def _packed(rgba: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Return colours, shape (n, 4), as one number each, shape (n,), so that a picture is one look-up a cell."""
    return np.ascontiguousarray(rgba).view(np.uint32)[:, 0]


def _label_colours() -> NDArray[np.uint32]:
    rgba = np.zeros((256, 4), np.uint8)
    rgba[FREE] = (58, 66, 80, 255)
    rgba[OCCUPIED] = (255, 140, 80, 255)
    return _packed(rgba)


def _clearance_colours() -> NDArray[np.uint32]:
    levels = np.arange(256, dtype=np.uint8)[:, None]
    rgb = cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS)[:, 0, ::-1]
    return _packed(np.concatenate((rgb, np.full((256, 1), 255, np.uint8)), axis=1).astype(np.uint8))


def _rate_colours() -> NDArray[np.uint32]:
    rate = (np.arange(256) - 128.0) * (RATE_SHOWN_M_S / 127.0)
    rgba = np.zeros((256, 4), np.uint8)
    rgba[rate < -RATE_STILL_M_S] = (230, 60, 60, 0)
    rgba[rate > RATE_STILL_M_S] = (70, 130, 240, 0)
    moves = np.abs(rate) > RATE_STILL_M_S
    rgba[moves, 3] = np.clip(80.0 + 175.0 * np.abs(rate[moves]) / RATE_SHOWN_M_S, 0.0, 255.0)
    return _packed(rgba)


_LABEL_RGBA = _label_colours()
_RATE_RGBA = _rate_colours()
_CLEARANCE_RGBA = _clearance_colours()
