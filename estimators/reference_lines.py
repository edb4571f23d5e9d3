"""Straight walls as they were seen first, in map: what later frames are registered against.

A line holds the moments of all points that were taken into it; direction and place follow from them, so that a wall of 20 m
keeps the direction that its first metres gave it.  Their number is bounded: the line that was not seen for longest makes room.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, Mask
from estimators.straight_pieces import StraightPieces

KNOWN_SHARE = 0.5  # of a piece's points on one line: it is a part of that
NEW_SHARE = 0.1  # of them on any line at most: it is a line of its own


class ReferenceLines:
    """A table of lines; empty rows have no ends apart."""

    def __init__(self, capacity: int, trusted_after: int) -> None:
        """Start with none; a line may move the pose once it was seen in `trusted_after` frames."""
        self._trusted_after = trusted_after
        self._moments = np.zeros((capacity, 6))  # weight, mean x, mean y, scatter xx, xy, yy
        self._ends = np.zeros((capacity, 4))
        self._sightings = np.zeros(capacity, dtype=np.int64)
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
        return np.asarray(self._sightings[: self._count] >= self._trusted_after)

    def learn(self, found: StraightPieces, noise_m: F64, line: NDArray[np.int64], frame: int, settle_frames: int | None) -> None:
        """Take the pieces of a frame, with points in map, into the lines they lie on, or as new lines.

        Args:
            found: the pieces; their directions are not looked at.
            noise_m: standard deviation of each point, shape (n,).
            line: on which line each point lies, negative for none, shape (n,).
            frame: the frame's number.
            settle_frames: lines seen in more frames than this stay as they are; None: none does.
        """
        for index in range(len(found.direction)):
            mine = found.piece == index
            on = line[mine]
            known = on[on >= 0]
            if len(known) >= KNOWN_SHARE * len(on):
                best = int(np.bincount(known).argmax())
                self._seen[best] = frame
                if settle_frames is None or self._sightings[best] < settle_frames:
                    self._take(best, found.points[mine], noise_m[mine])
            elif len(known) <= NEW_SHARE * len(on):
                best = self._free_row()
                self._moments[best], self._sightings[best], self._seen[best] = 0.0, 0, frame
                self._take(best, found.points[mine], noise_m[mine])

    def _free_row(self) -> int:
        if self._count < len(self._moments):
            self._count += 1
            return self._count - 1
        return int(self._seen.argmin())

    def _take(self, row: int, points: F64, noise_m: F64) -> None:
        """Add points, shape (n, 2), to a line's moments and say anew where it lies."""
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
        self._normal[:count], self._offset[:count] = state["normal"], state["offset"]
