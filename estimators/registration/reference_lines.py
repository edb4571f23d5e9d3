"""Straight walls as they were seen first, in map: what later frames are registered against.

A line holds the moments of all points that were taken into it; direction and place follow from them, so that a wall of 20 m
keeps the direction that its first metres gave it.  Their number is bounded: the line that was not seen for longest makes room.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, Mask
from estimators.registration.straight_pieces import StraightPieces

KNOWN_SHARE = 0.5  # of a piece's points on one line: it is a part of that
NEW_SHARE = 0.1  # of them on any line at most: it is a line of its own
MOVED = 0.5  # mean square of the distances from a line that is not trusted yet, over the noise's: it does not stand still


@dataclass(frozen=True, slots=True)
class Sighting:
    """The straight pieces of a frame, and how they lie on the lines."""

    pieces: StraightPieces  # with points in map; their directions are not looked at
    noise_m: F64  # (n,), standard deviation of each point
    deviation_m: F64  # (n,), how far from a line it may lie to be a part of it
    line: NDArray[np.int64]  # (n,), on which line each point was found, negative for none


class ReferenceLines:
    """A table of lines; empty rows have no ends apart."""

    def __init__(self, capacity: int, trusted_after: int) -> None:
        """Start with none; a line may move the pose once `trusted_after` frames in a row found it in its place.

        Those of the first frame may at once: where they lie is what the map is.
        """
        self._trusted_after = trusted_after
        self._moments = np.zeros((capacity, 6))  # weight, mean x, mean y, scatter xx, xy, yy
        self._ends = np.zeros((capacity, 4))
        self._sightings = np.zeros(capacity, dtype=np.int64)
        self._trusted = np.zeros(capacity, dtype=np.bool_)
        self._seen = np.zeros(capacity, dtype=np.int64)  # the number of the frame that saw it last
        self._count = 0
        self._normal, self._offset = np.zeros((capacity, 2)), np.zeros(capacity)

    def __len__(self) -> int:
        """Return the number of lines."""
        return self._count

    @property
    def normal(self) -> F64:
        """Unit normals, shape (lines, 2)."""
        return self._normal[: self._count]

    @property
    def offset(self) -> F64:
        """Where they lie, shape (lines,) [m]: normal . point = offset."""
        return self._offset[: self._count]

    @property
    def ends(self) -> F64:
        """Between which points they were seen, shape (lines, 4): x, y, x, y [m]."""
        return self._ends[: self._count]

    @property
    def trusted(self) -> Mask:
        """Which of them may move the pose, shape (lines,)."""
        return self._trusted[: self._count]

    def learn(self, seen: Sighting, frame: int, settle_frames: int | None) -> None:
        """Take the pieces of a frame into the lines they lie on, or as new lines.

        Args:
            seen: the pieces.
            frame: the frame's number.
            settle_frames: lines seen in more frames than this stay as they are; None: none does.
        """
        first = self._count == 0
        for index in range(len(seen.pieces.direction)):
            mine = seen.pieces.piece == index
            known = seen.line[mine & (seen.line >= 0)]
            size = np.count_nonzero(mine)
            if len(known) >= KNOWN_SHARE * size:
                self._see_again(int(np.bincount(known).argmax()), seen, mine, frame, settle_frames)
            elif len(known) <= NEW_SHARE * size:
                row = self._free_row()
                self._trusted[row] = first
                self._begin(row, seen, mine, frame)

    def _see_again(self, row: int, seen: Sighting, mine: Mask, frame: int, settle_frames: int | None) -> None:
        apart_m = np.abs(seen.pieces.points @ self._normal[row] - self._offset[row])
        self._seen[row] = frame
        if not self._trusted[row] and float(np.mean((apart_m[mine] / seen.noise_m[mine]) ** 2)) > MOVED:
            self._begin(row, seen, mine, frame)
        elif settle_frames is None or self._sightings[row] < settle_frames:
            mine = mine & (apart_m <= seen.deviation_m)
            self._take(row, seen.pieces.points[mine], seen.noise_m[mine])
            self._trusted[row] |= self._sightings[row] >= self._trusted_after

    def _begin(self, row: int, seen: Sighting, mine: Mask, frame: int) -> None:
        self._moments[row], self._sightings[row], self._seen[row] = 0.0, 0, frame
        self._take(row, seen.pieces.points[mine], seen.noise_m[mine])

    def _free_row(self) -> int:
        if self._count < len(self._moments):
            self._count += 1
            return self._count - 1
        return int(self._seen.argmin())

    def _take(self, row: int, points: F64, noise_m: F64) -> None:
        """Add points, shape (n, 2), to a line's moments and say anew where it lies."""
        if len(points) == 0:
            return
        weights = 1.0 / noise_m**2
        weight, mean = float(weights.sum()), np.average(points, axis=0, weights=weights)
        apart = points - mean
        scatter = (weights[:, None] * apart).T @ apart
        old_weight, old_mean = self._moments[row, 0], self._moments[row, 1:3]
        total = old_weight + weight
        step = mean - old_mean
        # Chan, Golub, LeVeque, Updating formulae for computing sample variances (1979), for the scatter of two sets together.
        scatter += np.outer(step, step) * (old_weight * weight / total)
        added = (scatter[0, 0], scatter[0, 1], scatter[1, 1])
        self._moments[row, 1:3] = old_mean + step * (weight / total)
        self._moments[row, 0], self._moments[row, 3:] = total, self._moments[row, 3:] + added
        self._sightings[row] += 1
        self._lay(row, points)

    def _lay(self, row: int, points: F64) -> None:
        """Lay the line through its moments, as far as it was seen."""
        _, x, y, xx, xy, yy = self._moments[row]
        angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
        direction, normal = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        seen = points if self._sightings[row] == 1 else np.concatenate((points, self._ends[row].reshape(2, 2)))
        along = (seen - (x, y)) @ direction
        self._normal[row], self._offset[row] = normal, normal @ (x, y)
        self._ends[row] = np.concatenate([(x, y) + direction * far for far in (along.min(), along.max())])

    def snapshot(self) -> bytes:
        """Return the whole state."""
        count = self._count
        return pack(
            moments=self._moments[:count],
            ends=self._ends[:count],
            sightings=self._sightings[:count],
            trusted=self.trusted,
            seen=self._seen[:count],
            normal=self.normal,
            offset=self.offset,
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        self._count = count = len(state["offset"])
        self._moments[:count], self._ends[:count] = state["moments"], state["ends"]
        self._sightings[:count], self._seen[:count] = state["sightings"], state["seen"]
        self._trusted[:count] = state["trusted"]
        self._normal[:count], self._offset[:count] = state["normal"], state["offset"]
