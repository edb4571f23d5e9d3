"""Recorded depth frames through the whole estimator: what is shown near the camera that the raw depth does not show.

The camera is taken to stand level and still.  Plain geometry is the judge: the raw returns of the slab, pixel by pixel, of this
frame and all before.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import BODY_FROM_OPTICAL, SE2, SE3
from drivers.interface.mission import Mission
from drivers.interface.samples import DepthFrame, Intrinsics, Stamp, frozen_array
from drivers.interface.sensed import Sensed, Tick
from estimators.belief import OCCUPIED, OccupancyGrid
from estimators.estimator import EstimatorSetup
from estimators.standard import StandardEstimator, StandardSettings

U16 = NDArray[np.uint16]
FRAME_NS, HEIGHT_M, DEPTH_UNIT_M = 33_333_333, 0.4, 0.001
Cell = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Phantoms:
    """Sums over all frames."""

    frames: int
    occupied_cells: int  # within reach of the claim
    phantom_cells: int  # of them, with no raw return in them so far


def read_frames(folder: Path) -> tuple[U16, ...]:
    """Return the depth images of a folder in the order of their names; a file that is none is left out.

    Raises:
        ConfigurationError: there is none.
    """
    images = (cv2.imread(str(path), cv2.IMREAD_UNCHANGED) for path in sorted(folder.glob("*.png")))
    frames = tuple(
        frozen_array(image.astype(np.uint16, copy=False)) for image in images if image is not None and image.dtype == np.uint16
    )
    if not frames:
        raise ConfigurationError(
            f"frames.path: the folder '{folder}' holds no 16-bit PNG file; --set frames.path=FOLDER names another"
        )
    return frames


def grids(images: tuple[U16, ...], camera: Intrinsics, keys: dict[str, Any]) -> Iterator[OccupancyGrid]:
    """Return what a whole estimator makes of each frame, one after the other.

    Raises:
        ConfigurationError: the estimator refuses a frame.
    """
    settings = StandardSettings.model_validate(keys)
    estimator = StandardEstimator(settings, EstimatorSetup(0.05, 0.06, SE2(), None))
    estimator.warm_up()
    pose = SE3(0.0, 0.0, HEIGHT_M) @ BODY_FROM_OPTICAL
    for index, image in enumerate(images):
        stamp = Stamp(index * FRAME_NS, index * FRAME_NS, index)
        frame = DepthFrame(stamp, image, DEPTH_UNIT_M, camera, pose)
        tick = Tick(index, (index + 1) * FRAME_NS, FRAME_NS)
        belief = estimator.update(Sensed(tick, frame, (), (), (), (), (), None, (), Mission(SE2(), ())))
        if belief.faults:
            raise ConfigurationError(f"frames: frame {index}: {belief.faults[0].value}: is it {camera.width}x{camera.height}?")
        yield belief.grid


def phantoms(images: tuple[U16, ...], camera: Intrinsics, keys: dict[str, Any], within_m: float) -> Phantoms:
    """Play the frames through an estimator of these settings and count what no frame so far shows, within a distance."""
    depth = StandardSettings.model_validate(keys).depth
    shown: set[Cell] = set()
    occupied = phantom = count = 0
    for image, grid in zip(images, grids(images, camera, keys), strict=True):
        shown |= cells_of(returns(image, camera, depth.slab_low_m, depth.slab_high_m), grid.lattice.cell_m)
        near = occupied_within(grid, within_m)
        occupied, phantom, count = occupied + len(near), phantom + len(near - shown), count + 1
    return Phantoms(count, occupied, phantom)


def returns(image: U16, camera: Intrinsics, low_m: float, high_m: float) -> NDArray[np.float64]:
    """Return where in the plane the raw returns of the slab lie, shape (n, 2), with the camera at the origin."""
    v, u = np.nonzero(image)
    z = image[v, u] * DEPTH_UNIT_M
    up = -(v - camera.cy) / camera.fy * z
    points = np.stack((z, -(u - camera.cx) / camera.fx * z), axis=1)
    return np.asarray(points[(up >= low_m - 1e-6) & (up <= high_m + 1e-6)])


def cells_of(points: NDArray[np.float64], cell_m: float) -> set[Cell]:
    """Return the cells that points fall into, as whole numbers of cells from odom's origin."""
    return {(x, y) for x, y in np.floor(points / cell_m).astype(int).tolist()}


def occupied_within(grid: OccupancyGrid, within_m: float) -> set[Cell]:
    """Return the occupied cells within a distance of the origin."""
    centres = grid.lattice.centres(*np.nonzero(grid.label == OCCUPIED))
    return cells_of(centres[np.hypot(*centres.T) < within_m], grid.lattice.cell_m)
