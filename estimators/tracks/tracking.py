"""Moving obstacles without classes: discs that no static wall explains, followed from frame to frame in odom.

Components of cells become discs (`estimators.tracks.segmentation`), discs are given to tracks by the assignment of least total
distance, tracks move at constant velocity (`estimators.tracks.constant_velocity`).  A track is given out once it was seen often
enough.  Out of sight it coasts; where its place is seen to be free it soon ends.  What stands still long enough to count as
static is the grid's business and no longer a track's.

Source of the scheme: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, chapters 1 and 6.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from drivers.interface.samples import frozen_array
from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, FREE, OccupancyGrid, Track
from estimators.grid.labelling import FrameLabels
from estimators.memory.remembered import Remembered
from estimators.tracks import segmentation
from estimators.tracks.constant_velocity import PLANE, ConstantVelocity, Motion, corrected, shifted, squared_distances
from estimators.tracks.segmentation import Disc, Segment, centred, segments, surfaces_of
from estimators.tracks.traces import Traces
from estimators.tracks.tracking_settings import TrackingSettings

SECOND_NS = 1_000_000_000
BEYOND = 1e6  # the cost of what is outside the gate


@dataclass(frozen=True, slots=True)
class Followed:
    """A track as it is kept between frames."""

    identity: int
    motion: Motion
    radius_m: float
    hits: int
    seen_ns: int

    @property
    def disc(self) -> Disc:
        """Where it is."""
        return Disc(float(self.motion.state[0]), float(self.motion.state[1]), self.radius_m)


class GridTracker:
    """Follows what moves through the frames."""

    def __init__(self, settings: TrackingSettings) -> None:
        """Start without tracks."""
        self._settings = settings
        self._tracks: list[Followed] = []  # by identity
        self._next_identity = 0
        self._stamp_ns = 0
        self._traces = Traces(settings.left_width_max_m)

    def warm_up(self) -> None:
        """Compile every kernel."""
        segmentation.warm_up()

    def update(self, frame: FrameLabels, remembered: Remembered, stamp_ns: int) -> None:
        """Take in a frame captured at `stamp_ns`, and what the memory knows with it."""
        settings = self._settings
        carry = ConstantVelocity((stamp_ns - self._stamp_ns) / SECOND_NS, settings.acceleration_m_s2)
        self._stamp_ns = stamp_ns
        tracks = [replace(one, motion=carry.carry(one.motion)) for one in self._tracks if self._recent(one, stamp_ns)]
        surfaces = surfaces_of(frame, remembered, self._traces, stamp_ns, settings.clear_cells)
        found = segments(surfaces, [track.disc for track in tracks], settings.cells_min, settings.radius_max_m)
        pairs = self._assign(tracks, found)
        tracks = [self._seen(track, found[pairs[i]]) if i in pairs else track for i, track in enumerate(tracks)]
        taken = set(pairs.values())
        born = [segment for index, segment in enumerate(found) if index not in taken and segment.loose]
        self._tracks = [track for track in tracks if self._lives(track, frame.grid)]
        for segment in born:
            self._give_birth(segment)

    def _assign(self, tracks: list[Followed], found: list[Segment]) -> dict[int, int]:
        """Return which segment each track gets, by their places in the lists."""
        around = [(t, track.disc, self._reach_m(track)) for t, track in enumerate(tracks)]
        close = [(t, s) for t, disc, reach_m in around for s, one in enumerate(found) if _apart_m(disc, one.disc) < reach_m]
        if not close:
            return {}
        centres = np.array([centred(found[s], tracks[t].radius_m) for t, s in close])
        sigmas_m = np.array([self._sigma_m(tracks[t], found[s]) for t, s in close])
        distances = squared_distances([tracks[t].motion for t, _ in close], centres, sigmas_m)
        cost = np.full((len(tracks), len(found)), BEYOND)
        cost[tuple(np.transpose(close))] = np.where(distances <= self._settings.gate, distances, BEYOND)
        return {int(t): int(s) for t, s in zip(*linear_sum_assignment(cost), strict=True) if cost[t, s] < BEYOND}

    def _reach_m(self, track: Followed) -> float:
        """Return how far from a track's centre a segment's is at most, if it may be the track's."""
        spread = track.motion.covariance
        doubt_m = math.sqrt(spread[0, 0] + spread[1, 1]) + self._settings.sigma_m + track.radius_m
        return math.sqrt(self._settings.gate) * doubt_m + track.radius_m

    def _sigma_m(self, track: Followed, segment: Segment) -> float:
        """Return how far off a centre may be: what shows neither of its sides may reach to either beyond what is seen."""
        return self._settings.sigma_m + _slack_m(segment, track.radius_m)

    def _seen(self, track: Followed, segment: Segment) -> Followed:
        settings, wider_m = self._settings, segment.disc.radius_m - track.radius_m
        narrower = 0.1 * settings.radius_gain if segment.outline.whole else 0.0
        gain = settings.radius_gain if wider_m > 0.0 else narrower
        radius_m = max(track.radius_m + gain * wider_m, settings.radius_min_m)
        covariance, centre = self._sigma_m(track, segment) ** 2 * PLANE, centred(segment, track.radius_m)
        moved = corrected(track.motion, centre, covariance)
        motion = shifted(moved, centred(segment, radius_m) - centre)  # a disc that grows has not moved
        seen_ns = self._stamp_ns if segment.loose else track.seen_ns  # or a track that met a wall's end would follow it
        return Followed(track.identity, motion, radius_m, track.hits + 1, seen_ns)

    def _lives(self, track: Followed, seen: OccupancyGrid) -> bool:
        row, column = (int(index[0]) for index in seen.lattice.cell_of(track.motion.state[None, :2]))
        inside = 0 <= row < seen.lattice.rows and 0 <= column < seen.lattice.columns
        gone = (inside and seen.label[row, column] == FREE) or track.hits < self._settings.hits_min
        return not gone or self._stamp_ns - track.seen_ns <= self._settings.vanish_s * SECOND_NS

    def _give_birth(self, segment: Segment) -> None:
        """Begin a track, unless the segment is a piece of one that is there; what is hidden in part is as wide as is usual."""
        settings = self._settings
        least_m = settings.radius_min_m if segment.outline.whole else settings.radius_usual_m
        radius_m = max(segment.disc.radius_m, least_m)
        x, y = centred(segment, radius_m)
        if any((x - one.disc.x_m) ** 2 + (y - one.disc.y_m) ** 2 < one.radius_m**2 for one in self._tracks):
            return
        sigma_m = settings.sigma_m + _slack_m(segment, radius_m)
        variance = np.repeat((sigma_m**2, settings.speed_sigma_m_s**2), 2)
        motion = Motion(np.array([x, y, 0.0, 0.0]), np.diag(variance))
        self._tracks.append(Followed(self._next_identity, motion, radius_m, 1, self._stamp_ns))
        self._next_identity += 1

    def tracks_at(self, time_ns: int) -> tuple[Track, ...]:
        """Return the tracks that were seen often enough and not too long ago, carried on to a time, by identity."""
        settings = self._settings
        carry = ConstantVelocity(max(time_ns - self._stamp_ns, 0) / SECOND_NS, settings.acceleration_m_s2)
        return tuple(
            _track(one, carry.carry(one.motion))
            for one in self._tracks
            if one.hits >= settings.hits_min and self._recent(one, time_ns)
        )

    def _recent(self, track: Followed, time_ns: int) -> bool:
        return time_ns - track.seen_ns <= self._settings.coast_s * SECOND_NS

    def snapshot(self) -> bytes:
        """Return the whole state."""
        tracks = self._tracks
        return pack(
            identity=np.array([track.identity for track in tracks], dtype=np.int64),
            state=np.array([track.motion.state for track in tracks]).reshape(-1, 4),
            covariance=np.array([track.motion.covariance for track in tracks]).reshape(-1, 4, 4),
            radius_m=np.array([track.radius_m for track in tracks], dtype=np.float64),
            hits=np.array([track.hits for track in tracks], dtype=np.int64),
            seen_ns=np.array([track.seen_ns for track in tracks], dtype=np.int64),
            next_identity=self._next_identity,
            stamp_ns=self._stamp_ns,
            traces=np.frombuffer(self._traces.snapshot(), dtype=np.uint8),
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        motions = [Motion(*both) for both in zip(state["state"], state["covariance"], strict=True)]
        numbers = (state[name].tolist() for name in ("identity", "radius_m", "hits", "seen_ns"))
        self._tracks = [
            Followed(identity, motion, radius_m, hits, seen_ns)
            for motion, identity, radius_m, hits, seen_ns in zip(motions, *numbers, strict=True)
        ]
        self._traces.restore(state["traces"].tobytes())
        self._next_identity, self._stamp_ns = int(state["next_identity"]), int(state["stamp_ns"])


def _apart_m(one: Disc, other: Disc) -> float:
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)


def _slack_m(segment: Segment, radius_m: float) -> float:
    """Return how far a disc that shows neither of its sides may reach to either beyond what is seen of it."""
    own = segment.outline.right_own or segment.outline.left_own
    return 0.0 if own else max(0.0, radius_m - segment.disc.radius_m)


def _track(one: Followed, now: Motion) -> Track:
    x, y, vx, vy = now.state.tolist()
    covariance: F64 = frozen_array(0.5 * (now.covariance + now.covariance.T))
    return Track(one.identity, (x, y), (vx, vy), one.radius_m, covariance)
