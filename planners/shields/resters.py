"""Who may set off: tracks that came here on their own and have slowed down or stand, and the velocity that they came with.

A constant velocity says of one who stops to let somebody by, or hesitates, that he stays for good.  Whoever came may go on; who
never left his place is a post.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivers.interface.stateful import pack, unpack
from estimators.belief import Belief, Track

SECOND_NS = 1_000_000_000
CAME_M = 0.3  # from where it was first seen; what stands, and is seen from here and from there, shifts by less
SLOWED = 0.7  # of the velocity that it came with


@dataclass(frozen=True, slots=True)
class _Way:
    """Where a track was first seen, and the velocity that it last kept up, in odom."""

    origin: tuple[float, float]
    came: bool  # it has left its origin
    velocity: tuple[float, float]
    kept_ns: int  # when it last drove as fast as that


class Resters:
    """Remembers of every track how it came."""

    def __init__(self, patience_s: float) -> None:
        """Who has not gone on for `patience_s` stays."""
        self._patience_ns = round(patience_s * SECOND_NS)
        self._ways: dict[int, _Way] = {}

    def observe(self, belief: Belief) -> tuple[tuple[Track, tuple[float, float]], ...]:
        """Take in the tracks of a belief; return those that may set off, and with which velocity [m/s] in odom."""
        tracks = [track for track in belief.tracks if np.isfinite((*track.position_in_odom, *track.velocity_in_odom)).all()]
        self._ways = {track.identity: self._way(track, belief.stamp_ns) for track in tracks}
        found = ((track, self._ways[track.identity]) for track in tracks)
        return tuple(
            (track, way.velocity)
            for track, way in found
            if way.came and math.hypot(*track.velocity_in_odom) < SLOWED * math.hypot(*way.velocity)
        )

    def _way(self, track: Track, now_ns: int) -> _Way:
        here, now = track.position_in_odom, track.velocity_in_odom
        before = self._ways.get(track.identity)
        if before is None:
            return _Way(here, False, now, now_ns)
        came = before.came or math.dist(here, before.origin) > CAME_M
        kept = math.hypot(*now) >= SLOWED * math.hypot(*before.velocity)
        if kept or now_ns - before.kept_ns > self._patience_ns:
            return _Way(before.origin, came, now, now_ns)
        return _Way(before.origin, came, before.velocity, before.kept_ns)

    def snapshot(self) -> bytes:
        """Return the whole state."""
        ways = self._ways.values()
        return pack(
            identity=np.array(list(self._ways), np.int64),
            origin=np.array([way.origin for way in ways]).reshape(-1, 2),
            came=np.array([way.came for way in ways], np.bool_),
            velocity=np.array([way.velocity for way in ways]).reshape(-1, 2),
            kept_ns=np.array([way.kept_ns for way in ways], np.int64),
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        rows = zip(*(state[name].tolist() for name in ("identity", "origin", "came", "velocity", "kept_ns")), strict=True)
        self._ways = {
            identity: _Way((origin[0], origin[1]), came, (velocity[0], velocity[1]), kept_ns)
            for identity, origin, came, velocity, kept_ns in rows
        }
