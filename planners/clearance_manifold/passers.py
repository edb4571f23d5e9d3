"""Who walks up and down the way: where he was seen to go is where he will come again, so the robot keeps beside it.

Beyond the paper, whose walkers are met once.  Needs the belief's tracks (`estimator.tracks`); without any nobody is remembered.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.belief import F64, Belief, Track
from planners.clearance_manifold.ridge_kernels import Ground, walls
from planners.clearance_manifold.settings import PasserSettings

LIKE_COSINE, LIKE_M = 0.9, 0.5  # two lines with so little between them are one
STRAIGHT_M = 0.2  # who leaves his line by more does not walk along one
LOOKS = 15  # seen fewer times than this he may be the noise of a wall seen at a shallow angle,
NOISE_S = 2.0  # which is forgotten after so long,
MOST_M_S = 2.0  # and so may who is faster
KEPT_LOOKS = 200.0  # that a line is made of: odometry turns beneath it
MIDDLE_M = 0.75  # who walks farther from the middle of a corridor is the noise of its walls
LINES = 3  # that can lead by one place
SECOND_NS = 1_000_000_000
SUMS = 6  # of a line: number of looks, x, y, x^2, x y, y^2, about where it begins


class Passers:
    """The lines that somebody was seen to walk along, in odom."""

    def __init__(self, settings: PasserSettings) -> None:
        """Start with nobody."""
        self._settings = settings
        self._lines: F64 = np.zeros((0, 8 + SUMS))  # identity, last seen [s], beginning, place and velocity then (2 each), sums
        self._now_s = 0.0

    def update(self, belief: Belief) -> None:
        """Take in who walks now, and forget who has not been seen for `remember_s`."""
        self._now_s = now_s = belief.stamp_ns / SECOND_NS
        ago_s, walks = now_s - self._lines[:, 1], self._lines[:, 8] >= LOOKS
        self._lines = self._lines[ago_s <= np.where(walks, self._settings.remember_s, NOISE_S)]
        for track in belief.tracks:
            if self._settings.least_m_s <= np.hypot(*track.velocity_in_odom) <= MOST_M_S:
                self._look(track, now_s)

    def _look(self, track: Track, now_s: float) -> None:
        """Add where somebody is to his line; a new one begins it, or goes on with one that leads there."""
        at = np.array(track.position_in_odom)
        own = np.flatnonzero(self._lines[:, 0] == track.identity)
        if not own.size:
            own = self._like(at, np.array(track.velocity_in_odom))
        if not own.size:
            begun = np.concatenate(([float(track.identity), now_s], at, np.zeros(4 + SUMS)))
            self._lines, own = np.vstack((self._lines, begun)), np.array([len(self._lines)])
        line = self._lines[own[0]]
        x, y = at - line[2:4]
        line[8:] *= 1.0 - 1.0 / KEPT_LOOKS
        line[8:] += 1.0, x, y, x * x, x * y, y * y
        line[:2], line[4:6], line[6:8] = (float(track.identity), now_s), at, track.velocity_in_odom

    def _like(self, at: F64, velocity: F64) -> NDArray[np.intp]:
        """Return the line, at most one, that leads by a place in the direction of a velocity, either way."""
        middle, along, _ = self._fitted()
        off = at - middle
        beside = np.abs(along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0])
        cosine = np.abs(along @ velocity) / max(float(np.hypot(*velocity)), 1e-9)
        return np.flatnonzero((beside < LIKE_M) & (cosine > LIKE_COSINE))[:1]

    def _fitted(self) -> tuple[F64, F64, F64]:
        """Return the lines' middles, unit directions, and standard deviations along and across, shape (n, 2) each."""
        sums = self._lines[:, 8:]
        count = np.maximum(sums[:, 0], 1.0)
        mean = sums[:, 1:3] / count[:, None]
        xx, xy, yy = (sums[:, 3 + k] / count - mean[:, i] * mean[:, j] for k, (i, j) in enumerate(((0, 0), (0, 1), (1, 1))))
        angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
        along = np.stack((np.cos(angle), np.sin(angle)), axis=1)
        half, spread = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
        sigmas = np.sqrt(np.maximum(np.stack((half + spread, half - spread), axis=1), 0.0))
        return self._lines[:, 2:4] + mean, along, sigmas

    def _walked(self, sigmas: F64) -> NDArray[np.intp]:
        """Return which lines somebody walks along, the most often walked first."""
        long_m = np.sqrt(12.0) * sigmas[:, 0]
        walks = (long_m >= self._settings.least_m) & (sigmas[:, 1] < STRAIGHT_M) & (self._lines[:, 8] >= LOOKS)
        order = np.argsort(-self._lines[:, 8], kind="stable")
        return np.asarray(order[walks[order]])

    def aside(self, points: F64) -> F64:
        """Return how far points, shape (n, 2), in odom, lie beside where somebody walks, and whereto, shape (n, 3).

        That is the room to him, negative where he walks, inf where nobody does, and the unit vector away from his line.
        Farther than `onward_m` from where he was seen a line is not taken to go on.
        """
        out = np.tile([np.inf, 0.0, 0.0], (len(points), 1))
        middle, along, sigmas = self._fitted()
        for i in self._walked(sigmas):
            off = points - middle[i]
            normal = np.array([-along[i, 1], along[i, 0]])
            across_m = off @ normal
            room_m = np.abs(across_m) - self._settings.half_width_m
            reach_m = 0.5 * np.sqrt(12.0) * sigmas[i, 0] + self._settings.onward_m
            nearer = (room_m < out[:, 0]) & (np.abs(off @ along[i]) < reach_m)
            out[nearer, 0] = room_m[nearer]
            out[nearer, 1:] = np.where(across_m[nearer] < 0.0, -1.0, 1.0)[:, None] * normal
        return out

    def comes(self, points: F64, until_s: float) -> bool:
        """Return whether somebody seen lately, going on as he did, is near points, shape (n, 2), in odom, within `until_s`."""
        middle, along, sigmas = self._fitted()
        for i in self._walked(sigmas):
            ago_s = self._now_s - self._lines[i, 1]
            if ago_s > self._settings.expect_s:
                continue
            speed = float(self._lines[i, 6:8] @ along[i])
            now_m = float((self._lines[i, 4:6] - middle[i]) @ along[i]) + speed * ago_s
            there = (points - middle[i]) @ along[i]
            first, last = sorted((now_m, now_m + speed * until_s))
            if first < there.max() + self._settings.apart_m and last > there.min() - self._settings.apart_m:
                return True
        return False

    def across(self, at: F64, normal: F64, ground: Ground) -> F64:
        """Return what they take up of cross-sections that they run along the way of, shape (n, LINES, 2): low and high, or NaN.

        The lines that were walked along most often count.

        Args:
            at: of the sections, shape (n, 2), in odom.
            normal: to the left, unit, shape (n, 2).
            ground: the field, for the middle of corridors.
        """
        taken = np.full((len(at), LINES, 2), np.nan)
        if not (len(self._lines) or self._settings.middle):
            return taken
        middle, along, sigmas = self._fitted()
        for k, i in enumerate(self._walked(sigmas)[:LINES]):
            beside = np.array([-along[i, 1], along[i, 0]])
            turned = normal @ beside
            offset = ((middle[i] - at) @ beside) / np.where(np.abs(turned) > LIKE_COSINE, turned, np.nan)
            runs = np.abs(offset) < self._settings.reach_m
            taken[runs, k] = offset[runs, None] + self._settings.half_width_m * np.array([-1.0, 1.0])
        if self._settings.middle:
            s = self._settings
            right_m, left_m = walls(ground, at, normal, s.widest_m).T
            corridor = (right_m + left_m >= s.narrowest_m) & (right_m + left_m <= s.widest_m)
            middle = 0.5 * (np.where(corridor, left_m, 0.0) - np.where(corridor, right_m, 0.0))
            seen = (np.abs(taken.mean(axis=2) - middle[:, None]) < MIDDLE_M).any(axis=1)  # not the noise of its walls
            expected = corridor & ~seen
            taken[expected, -1] = middle[expected, None] + s.half_width_m * np.array([-1.0, 1.0])
        return taken

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is remembered, as named arrays."""
        return {"passers": self._lines, "passers_now_s": np.array(self._now_s)}

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._lines, self._now_s = state["passers"].copy(), float(state["passers_now_s"])
