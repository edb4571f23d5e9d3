"""Tracks of fiducial markers: a marker's number is the track's identity, so nothing has to be assigned.

Each sighting gives a position with a covariance (`estimators.tracks.marker_pose`), which corrects a motion of constant velocity
(`estimators.tracks.constant_velocity`) in odom.  Unseen, a track coasts, ever less certain, and dies.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drivers.interface.geometry import SE2
from drivers.interface.samples import MarkerSample, frozen_array
from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, Track
from estimators.tracks.constant_velocity import ConstantVelocity, Motion, corrected, squared_distance
from estimators.tracks.marker_pose import marker_pose
from estimators.tracks.marker_settings import MarkerSettings

SECOND_NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Sighting:
    """Where in odom a marker was seen."""

    identity: int
    position_m: F64  # (2,)
    covariance_m2: F64  # (2, 2)


@dataclass(frozen=True, slots=True)
class MarkerTrack:
    """A marker as it is kept between images; its motion is that at the newest of them."""

    identity: int
    motion: Motion
    hits: int
    seen_ns: int


class MarkerTracker:
    """Follows every marker that is seen."""

    def __init__(self, settings: MarkerSettings) -> None:
        """Start without tracks."""
        self._settings = settings
        self._tracks: dict[int, MarkerTrack] = {}
        self._stamp_ns: int | None = None

    @property
    def stamp_ns(self) -> int | None:
        """When the newest image used was taken [ns]; None: there was none."""
        return self._stamp_ns

    def update(self, samples: tuple[MarkerSample, ...], latest_ns: int, pose_at: Callable[[int], SE2]) -> bool:
        """Take in samples, oldest first; `pose_at` gives `odom_from_base` at a time.

        False: one could not be used, being older than one before it, from after `latest_ns`, or not finite.
        """
        usable = [self._see(sample, pose_at) if self._is_sound(sample, latest_ns) else False for sample in samples]
        return all(usable)

    def _is_sound(self, sample: MarkerSample, latest_ns: int) -> bool:
        in_order = self._stamp_ns is None or sample.stamp.captured_ns > self._stamp_ns
        shaped = sample.corners_px.shape == (len(sample.ids), 4, 2)
        return in_order and sample.stamp.captured_ns <= latest_ns and shaped and bool(np.isfinite(sample.corners_px).all())

    def _see(self, sample: MarkerSample, pose_at: Callable[[int], SE2]) -> bool:
        stamp_ns = sample.stamp.captured_ns
        carry = self._carry(stamp_ns)
        self._tracks = {
            identity: MarkerTrack(identity, carry.carry(one.motion), one.hits, one.seen_ns)
            for identity, one in self._tracks.items()
            if self._lives(one, stamp_ns)
        }
        self._stamp_ns = stamp_ns
        for sighting in self._sightings(sample, pose_at(stamp_ns)):
            self._take(sighting, stamp_ns)
        return True

    def _sightings(self, sample: MarkerSample, odom_from_base: SE2) -> list[Sighting]:
        """Return where the markers of a sample are, but those whose corners are no square's, or whose number is there twice."""
        settings, camera = self._settings, sample.base_from_optical
        c, s = np.cos(odom_from_base.yaw), np.sin(odom_from_base.yaw)
        odom_from_optical = np.array([[c, -s, 0.0], [s, c, 0.0]]) @ camera.rotation  # (2, 3)
        found = []
        for identity, corners in zip(sample.ids, sample.corners_px, strict=True):
            pose = marker_pose(corners, settings.side_m, sample.intrinsics, settings.sigma_px)
            if sample.ids.count(identity) > 1 or pose is None or pose.residual_px > settings.residual_max_px:
                continue
            position = odom_from_base.apply(camera.apply(pose.position_m)[:2])
            found.append(Sighting(identity, position, odom_from_optical @ pose.covariance_m2 @ odom_from_optical.T))
        return found

    def _take(self, sighting: Sighting, stamp_ns: int) -> None:
        """Correct the marker's track, or begin one; a sighting too far off is another's number misread."""
        identity, track = sighting.identity, self._tracks.get(sighting.identity)
        if track is None:
            covariance = np.diag(np.repeat((0.0, self._settings.speed_sigma_m_s**2), 2))
            covariance[:2, :2] = sighting.covariance_m2
            motion = Motion(np.array([*sighting.position_m, 0.0, 0.0]), covariance)
            self._tracks[identity] = MarkerTrack(identity, motion, 1, stamp_ns)
        elif squared_distance(track.motion, sighting.position_m, sighting.covariance_m2) <= self._settings.gate:
            motion = corrected(track.motion, sighting.position_m, sighting.covariance_m2)
            self._tracks[identity] = MarkerTrack(identity, motion, track.hits + 1, stamp_ns)

    def tracks_at(self, time_ns: int) -> tuple[Track, ...]:
        """Return the tracks that were seen often enough and not too long ago, carried on to a time, by identity."""
        carry = self._carry(time_ns)
        return tuple(
            self._given(one, carry.carry(one.motion))
            for _, one in sorted(self._tracks.items())
            if one.hits >= self._settings.hits_min and self._lives(one, time_ns)
        )

    def _given(self, one: MarkerTrack, now: Motion) -> Track:
        x, y, vx, vy = now.state.tolist()
        covariance = frozen_array(0.5 * (now.covariance + now.covariance.T))
        return Track(one.identity, (x, y), (vx, vy), self._settings.radius_m, covariance)

    def _carry(self, time_ns: int) -> ConstantVelocity:
        elapsed_ns = 0 if self._stamp_ns is None else max(time_ns - self._stamp_ns, 0)
        return ConstantVelocity(elapsed_ns / SECOND_NS, self._settings.acceleration_m_s2)

    def _lives(self, track: MarkerTrack, time_ns: int) -> bool:
        return time_ns - track.seen_ns <= self._settings.coast_s * SECOND_NS

    def snapshot(self) -> bytes:
        """Return the whole state."""
        tracks = list(self._tracks.values())
        return pack(
            identity=np.array([track.identity for track in tracks], dtype=np.int64),
            state=np.array([track.motion.state for track in tracks]).reshape(-1, 4),
            covariance=np.array([track.motion.covariance for track in tracks]).reshape(-1, 4, 4),
            hits=np.array([track.hits for track in tracks], dtype=np.int64),
            seen_ns=np.array([track.seen_ns for track in tracks], dtype=np.int64),
            stamp_ns=np.array([] if self._stamp_ns is None else [self._stamp_ns], dtype=np.int64),
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        motions = [Motion(*both) for both in zip(state["state"], state["covariance"], strict=True)]
        numbers = (state[name].tolist() for name in ("identity", "hits", "seen_ns"))
        self._tracks = {
            identity: MarkerTrack(identity, motion, hits, seen_ns)
            for motion, identity, hits, seen_ns in zip(motions, *numbers, strict=True)
        }
        self._stamp_ns = int(state["stamp_ns"][0]) if state["stamp_ns"].size else None
