"""Which ways lead past the obstacles in the way, and on which side of each a band passes.

Source: Roesmann, Hoffmann, Bertram, Integrated online trajectory planning and optimization in distinctive topologies,
Robotics and Autonomous Systems 88, 2017.  For discs the winding of the band about each of them tells the classes apart.
"""

from __future__ import annotations

from itertools import product

import cv2
import numpy as np
from numpy.typing import NDArray

from estimators.belief import F64
from planners.standing import Discs, StandingWorld
from planners.teb.band import Band

Indices = NDArray[np.intp]

_LARGEST_M = 1.2  # of something that stands, across; what is larger is a wall, and the route's business


def standing_discs(world: StandingWorld) -> Discs:
    """Return the connected things that stand and are small enough to pass on either side, as discs around them."""
    cells = np.ascontiguousarray(world.occupied, dtype=np.uint8)
    _, _, stats, _ = cv2.connectedComponentsWithStats(cells, connectivity=8)
    left, top, width, height, _ = stats[1:].T.astype(np.float64)
    across = np.hypot(width, height) * world.lattice.cell_m
    small = across <= _LARGEST_M
    lattice = world.lattice
    x = lattice.x_m + (left + 0.5 * width) * lattice.cell_m
    y = lattice.y_m + (top + 0.5 * height) * lattice.cell_m
    return Discs(np.stack((x, y), axis=1)[small], np.zeros((int(small.sum()), 2)), 0.5 * across[small])


def joined(first: Discs, second: Discs) -> Discs:
    """Return the discs of both."""
    return Discs(
        np.concatenate((first.centre, second.centre)),
        np.concatenate((first.velocity, second.velocity)),
        np.concatenate((first.radius_m, second.radius_m)),
    )


def chosen(discs: Discs, which: Indices) -> Discs:
    """Return some of the discs, by index, shape (k,)."""
    return Discs(discs.centre[which], discs.velocity[which], discs.radius_m[which])


def _offsets(band: Band, discs: Discs) -> F64:
    """Return where each pose is from each disc when it is passed, shape (n, m, 2)."""
    centre = discs.centre[None] + band.passed_s[:, None, None] * discs.velocity[None]
    return np.asarray(band.poses[:, None, :2] - centre)


def in_the_way(band: Band, discs: Discs, within_m: float, most: int) -> tuple[Discs, Indices]:
    """Return the discs that a band comes near to, the first met first, and which of its poses is nearest to each, (k,)."""
    gaps = np.linalg.norm(_offsets(band, discs), axis=2) - discs.radius_m
    at = np.argmin(gaps, axis=0)
    met = np.flatnonzero(gaps.min(axis=0, initial=np.inf) < within_m)
    met = met[np.argsort(at[met], kind="stable")][:most]
    return chosen(discs, met), at[met]


def sides(band: Band, discs: Discs) -> tuple[bool, ...]:
    """Return on which side of each disc a band passes: whether the disc is to its left."""
    offset = _offsets(band, discs)
    bearing = np.arctan2(offset[..., 1], offset[..., 0])
    swept = (np.diff(bearing, axis=0) + np.pi) % (2.0 * np.pi) - np.pi
    return tuple(bool(side) for side in swept.sum(axis=0) > 0.0)


def detours(band: Band, discs: Discs, at: Indices, room_m: float) -> list[F64]:
    """Return paths, each of shape (m, 2), that pass the discs on every combination of sides.

    Each leaves the band's straight line for a point beside a disc, where it is when the band passes, `room_m` from its edge.
    """
    start, end = band.poses[0, :2], band.poses[-1, :2]
    chord = end - start
    left = np.array([-chord[1], chord[0]]) / max(float(np.hypot(*chord)), 1e-9)
    where = discs.centre + band.passed_s[at][:, None] * discs.velocity
    order = np.argsort(where @ chord, kind="stable")
    aside = discs.radius_m + room_m
    paths = []
    for signs in product((1.0, -1.0), repeat=len(discs)):
        points = [where[j] + signs[j] * aside[j] * left for j in order]
        paths.append(np.array([start, *points, end]))
    return paths
