"""What moves, as discs: the cells a frame saw occupied that the static world does not explain, in connected components."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.interface.samples import frozen_array
from estimators.belief import F64, OCCUPIED, U8, Lattice, Mask, OccupancyGrid
from estimators.grid.labelling import FrameLabels
from estimators.memory.remembered import Remembered
from estimators.memory.rolling import transfer
from estimators.tracks.components import cells_of, extents, sizes
from estimators.tracks.outline import Outline, apparent_radius_m, bearing_of, centre_of, outline_of
from estimators.tracks.traces import Traces

STATIC_SHARE = 0.5  # of a connected surface; from here on the rest is taken for a part of the same wall
NEIGHBOURS = np.ones((3, 3), dtype=np.uint8)


@dataclass(frozen=True, slots=True)
class Disc:
    """A round thing somewhere in odom."""

    x_m: float
    y_m: float
    radius_m: float


@dataclass(frozen=True, slots=True)
class Segment:
    """The seen surface of something that moves."""

    points: F64  # (n, 2), centres of its cells in odom
    outline: Outline
    disc: Disc  # what it looks like, by its width
    loose: bool  # whether most of it is sure to be no wall


def warm_up() -> None:
    """Compile every kernel."""
    nothing = OccupancyGrid(Lattice(0.0, 0.0, 1.0, 8, 8), frozen_array(np.zeros((8, 8), dtype=np.uint8)))
    component = np.zeros((8, 8), dtype=np.int32)
    cells_of(component, Traces().moving(nothing, component, np.zeros(1), 0))
    extents(component, 1)
    outline = outline_of(np.ones((1, 2)), 0.0, 0.0, nothing.label, 0.0, 0.0, 1.0)
    bearing_of(outline, 1.0)
    centre_of(np.ones((1, 2)), outline, 1.0)


def sensor_of(lattice: Lattice) -> tuple[float, float]:
    """Return where in odom [m] the sensor stood whose frame a lattice holds: in the middle, to half a cell."""
    return lattice.x_m + 0.5 * lattice.columns * lattice.cell_m, lattice.y_m + 0.5 * lattice.rows * lattice.cell_m


@dataclass(frozen=True, slots=True)
class Surfaces:
    """Which cells of a frame are occupied by what is not static."""

    lattice: Lattice
    label: U8  # (rows, columns), the frame's
    unexplained: Mask  # (rows, columns)
    loose: Mask  # (rows, columns); on open ground and no wall hangs together with it, or it has left ground


def surfaces_of(frame: FrameLabels, remembered: Remembered, traces: Traces, stamp_ns: int, clear_cells: int = 0) -> Surfaces:
    """Tell static and other surfaces of a frame apart by what the memory knows, and by the ground that they have left.

    A static surface may fall into the next cell as the robot moves, so what touches one is explained by it.  Where a wall
    comes into range, rays that end just before it make its cells free first, and so its end seems to have come there lately;
    but it hangs together with the rest of it, and what lies behind was never seen free.  So what stands on ground that was seen
    free for `clear_cells` all around is no wall's, though it touches one; 0: whatever touches a wall may be a part of it.
    """
    lattice, seen = frame.grid.lattice, frame.grid.label == OCCUPIED
    static = transfer((remembered.grid.label == OCCUPIED) & ~remembered.came, remembered.grid.lattice, lattice, False)
    explained = cv2.dilate(static.view(np.uint8), NEIGHBOURS) != 0
    length, component = cv2.connectedComponents(_joined(seen), connectivity=8)
    sides = extents(component, length) - 2  # (length, 2): it was joined by a cell all around
    moving = cells_of(component, traces.moving(frame.grid, component, lattice.cell_m * np.hypot(*sides.T), stamp_ns))
    unexplained = np.asarray(seen & (moving | ~explained))
    apart = sizes(component, unexplained, length) > STATIC_SHARE * sizes(component, seen, length)
    open_ground = transfer(remembered.open, remembered.grid.lattice, lattice, False)
    loose = moving | (open_ground & cells_of(component, apart))
    if clear_cells > 0:
        around = np.ones((2 * clear_cells + 1, 2 * clear_cells + 1), dtype=np.uint8)
        clear = cv2.erode(remembered.open.view(np.uint8), around) != 0
        loose |= transfer(np.asarray(clear), remembered.grid.lattice, lattice, False)
    return Surfaces(lattice, frame.grid.label, unexplained, np.asarray(loose))


def _joined(cells: Mask) -> U8:
    """Return the cells, shape (rows, columns), with gaps of two cells closed."""
    return np.asarray(cv2.dilate(cells.view(np.uint8), NEIGHBOURS), dtype=np.uint8)


def segments(surfaces: Surfaces, expected: list[Disc], cells_min: int, radius_max_m: float) -> list[Segment]:
    """Return the components of what is unexplained, in no order of meaning; one over two expected discs is cut between them."""
    lattice = surfaces.lattice
    _, component = cv2.connectedComponents(_joined(surfaces.unexplained), connectivity=8)
    rows, columns = np.nonzero(surfaces.unexplained)
    points, part, loose = lattice.centres(rows, columns), component[rows, columns], surfaces.loose[rows, columns]
    if len(expected) > 1 and len(points):
        part = _cut(points, part, expected)
    x, y = sensor_of(lattice)
    found = []
    for one in np.unique(part):
        surface = np.ascontiguousarray(points[part == one])
        if len(surface) >= cells_min:
            outline = outline_of(surface, x, y, surfaces.label, lattice.x_m, lattice.y_m, lattice.cell_m)
            radius = apparent_radius_m(outline)
            if radius <= radius_max_m:
                bearing, far = bearing_of(outline, radius), outline.nearest_m + radius
                disc = Disc(x + far * math.cos(bearing), y + far * math.sin(bearing), radius)
                found.append(Segment(surface, outline, disc, bool(loose[part == one].mean() > 0.5)))
    return found


def _cut(points: F64, part: NDArray[Any], expected: list[Disc]) -> NDArray[Any]:
    """Return the parts of points, shape (n,), with those cut that reach over more than one expected disc.

    Each point of such a part goes to the disc whose edge is nearest, among those that have points of it.
    """
    centres = np.array([(disc.x_m, disc.y_m) for disc in expected])
    radii = np.array([disc.radius_m for disc in expected])
    beyond = np.linalg.norm(points[:, None] - centres, axis=2) - radii  # (n, discs), from the edge [m]
    owner = beyond.argmin(axis=1)
    claimed = beyond.min(axis=1) < 0.5 * radii[owner]
    cut = part.copy()
    for one in np.unique(part):
        inside = part == one
        owners = np.unique(owner[inside & claimed])
        if len(owners) > 1:
            nearest = owners[beyond[inside][:, owners].argmin(axis=1)]
            cut[inside] = part.max() + 1 + one * len(expected) + nearest
    return cut


def centred(segment: Segment, radius_m: float) -> F64:
    """Return the centre in odom, shape (2,), of the disc of known radius that shows this surface to the sensor."""
    return np.array(centre_of(segment.points, segment.outline, radius_m))
