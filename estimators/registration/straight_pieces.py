"""Straight pieces of a surface seen as ordered points: iterative end-point fit.

Source: Nguyen, Gaechter, Martinelli, Tomatis, Siegwart, A comparison of line extraction algorithms using 2D range data for
indoor mobile robotics, Autonomous Robots 23 (2007), split-and-merge in its variant iterative-end-point-fit; a merge is not
needed, as what was split too finely still lies on the same reference.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import F64

NO_PIECE = -1


@dataclass(frozen=True, slots=True)
class StraightPieces:
    """Points and to which straight piece each belongs."""

    points: F64  # (n, 2)
    piece: NDArray[Any]  # (n,) int64, NO_PIECE or the index of its piece
    direction: F64  # (pieces, 2), unit length


def straight_pieces(points: F64, deviation_m: F64, gap_m: float, length_min_m: float, points_min: int) -> StraightPieces:
    """Return the pieces among points, shape (n, 2), in the order of their bearing.

    Args:
        points: neighbours on the surface are neighbours here.
        deviation_m: of each point from the line between its piece's ends, shape (n,).
        gap_m: between neighbours that do not hang together.
        length_min_m: shorter pieces are none.
        points_min: nor are those with fewer points.
    """
    points = np.ascontiguousarray(points)
    piece = np.full(len(points), NO_PIECE, dtype=np.int64)
    direction = np.empty((len(points), 2))
    count = _split(points, deviation_m, gap_m, length_min_m, points_min, piece, direction)
    return StraightPieces(points, piece, direction[:count])


@kernel()
def _distance(points: F64, one: int, other: int) -> float:
    return float(np.hypot(points[other, 0] - points[one, 0], points[other, 1] - points[one, 1]))


@kernel()
def _farthest(points: F64, deviation_m: F64, first: int, last: int) -> tuple[int, float, float]:
    """Return which point between two lies farthest from the line through them beyond its deviation, how far beyond, and the
    distance of the two.
    """
    dx, dy = points[last, 0] - points[first, 0], points[last, 1] - points[first, 1]
    length = _distance(points, first, last)
    index, beyond = first, 0.0
    if length > 0.0:
        for i in range(first + 1, last):
            off = abs(dx * (points[i, 1] - points[first, 1]) - dy * (points[i, 0] - points[first, 0])) / length
            if off - deviation_m[i] > beyond:
                index, beyond = i, off - deviation_m[i]
    return index, beyond, length


@kernel()
def _principal_direction(points: F64) -> tuple[float, float]:
    """Return the unit vector along which points, shape (n, 2), scatter most."""
    mean_x, mean_y = points[:, 0].mean(), points[:, 1].mean()
    xx, xy, yy = 0.0, 0.0, 0.0
    for x, y in points:
        xx, xy, yy = xx + (x - mean_x) ** 2, xy + (x - mean_x) * (y - mean_y), yy + (y - mean_y) ** 2
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    return np.cos(angle), np.sin(angle)


@kernel()
def _split(
    points: F64, deviation_m: F64, gap_m: float, length_min_m: float, points_min: int, piece: NDArray[Any], direction: F64
) -> int:
    """Write each point's piece and each piece's direction; return the number of pieces."""
    found, start = 0, 0
    stack = np.empty((len(points) + 1, 2), dtype=np.int64)
    for end in range(len(points)):
        if end + 1 < len(points) and _distance(points, end, end + 1) <= gap_m:
            continue
        stack[0, 0], stack[0, 1], depth = start, end, 1
        start = end + 1
        while depth > 0:
            depth -= 1
            first, last = stack[depth, 0], stack[depth, 1]
            index, beyond, length = _farthest(points, deviation_m, first, last)
            if last - first + 1 < points_min:
                continue
            if beyond > 0.0:
                stack[depth, 0], stack[depth, 1] = index, last
                stack[depth + 1, 0], stack[depth + 1, 1] = first, index
                depth += 2
                continue
            if length < length_min_m:
                continue
            piece[first : last + 1] = found
            direction[found, 0], direction[found, 1] = _principal_direction(points[first : last + 1])
            found += 1
    return found
