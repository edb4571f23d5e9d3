"""Who may set off: tracks that came here on their own and have slowed down or stand, and the velocity that they came with.

A constant velocity says of one who stops to let somebody by, or hesitates, that he stays for good.  Whoever came may go on; who
never left his place is a post.  A tracker soon takes who stands for a part of the grid: he is remembered where he stood.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivers.interface.samples import frozen_array
from drivers.interface.stateful import pack, unpack
from estimators.belief import Belief, Track
from estimators.field_query import sample
from planners.static_field import GRID_M, STILL_M_S

SECOND_NS = 1_000_000_000
CAME_M = 0.3  # from where it was first seen; what stands, and is seen from here and from there, shifts by less
SLOWED = 0.7  # of the velocity that it came with
_EXACT = frozen_array(np.zeros((4, 4)))


@dataclass(frozen=True, slots=True)
class _Way:
    """How a track came; odom frame."""

    origin: tuple[float, float]  # where it was first seen
    came: bool  # it has left its origin
    steady: tuple[float, float]  # its velocity, smoothed
    velocity: tuple[float, float]  # that it last kept up; until it came, that of now, as a new track's is a guess
    kept_ns: int  # when it last drove as fast as that
    place: tuple[float, float]  # where it stood when it stood last
    radius_m: float
    stands: bool


class Resters:
    """Remembers of every track how it came."""

    def __init__(self, patience_s: float, steady_s: float) -> None:
        """Who has not gone on for `patience_s` stays; velocities count smoothed, with the time constant `steady_s`."""
        self._patience_ns, self._steady_ns = round(patience_s * SECOND_NS), steady_s * SECOND_NS
        self._ways: dict[int, _Way] = {}
        self._stamp_ns = 0  # of the belief before

    def observe(self, belief: Belief) -> tuple[tuple[Track, tuple[float, float]], ...]:
        """Take in the tracks of a belief; return those that may set off, and with which velocity [m/s] in odom."""
        tracks = [track for track in belief.tracks if np.isfinite((*track.position_in_odom, *track.velocity_in_odom)).all()]
        seen = {track.identity for track in tracks}
        left = {name: way for name, way in self._ways.items() if name not in seen and self._waits(way, tracks, belief)}
        self._ways = {track.identity: self._way(track, belief.stamp_ns) for track in tracks} | left
        self._stamp_ns = belief.stamp_ns
        tracks += [Track(name, way.place, (0.0, 0.0), way.radius_m, _EXACT) for name, way in left.items()]
        found = ((track, self._ways[track.identity]) for track in tracks)
        return tuple(
            (track, way.velocity)
            for track, way in found
            if way.came and math.hypot(*track.velocity_in_odom) < SLOWED * math.hypot(*way.velocity)
        )

    def _waits(self, way: _Way, tracks: list[Track], belief: Belief) -> bool:
        """Return whether somebody who is no track any more still stands where he stood: as a part of the grid."""
        if not (way.came and way.stands) or belief.stamp_ns - way.kept_ns > self._patience_ns:
            return False
        if any(math.dist(way.place, track.position_in_odom) < way.radius_m for track in tracks):
            return False
        field = belief.clearance
        return float(sample(field.clearance_m, field.lattice, np.array([way.place]))[0]) <= way.radius_m + GRID_M

    def _way(self, track: Track, now_ns: int) -> _Way:
        here, now, radius_m = track.position_in_odom, track.velocity_in_odom, track.radius_m
        before = self._ways.get(track.identity)
        if before is None:
            return _Way(here, False, now, now, now_ns, here, radius_m, False)
        share = 1.0 - math.exp((self._stamp_ns - now_ns) / self._steady_ns) if self._steady_ns > 0.0 else 1.0
        steady = before.steady[0] + share * (now[0] - before.steady[0]), before.steady[1] + share * (now[1] - before.steady[1])
        least_m_s, speed_m_s = SLOWED * math.hypot(*before.velocity), math.hypot(*now)
        came = before.came or math.dist(here, before.origin) > CAME_M
        kept = min(speed_m_s, math.hypot(*steady)) >= least_m_s
        place, stands = (here, True) if speed_m_s < STILL_M_S else (before.place, before.stands and not kept)
        if kept or not came or now_ns - before.kept_ns > self._patience_ns:
            return _Way(before.origin, came, steady, steady, now_ns, place, radius_m, stands)
        return _Way(before.origin, came, steady, before.velocity, before.kept_ns, place, radius_m, stands)

    def snapshot(self) -> bytes:
        """Return the whole state."""
        ways = self._ways.values()
        return pack(
            identity=np.array(list(self._ways), np.int64),
            numbers=np.array([_numbers(way) for way in ways]).reshape(-1, 9),
            came=np.array([way.came for way in ways], np.bool_),
            stands=np.array([way.stands for way in ways], np.bool_),
            kept_ns=np.array([way.kept_ns for way in ways], np.int64),
            stamp_ns=self._stamp_ns,
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        rows = zip(*(state[name].tolist() for name in ("identity", "numbers", "came", "stands", "kept_ns")), strict=True)
        self._ways = {
            name: _Way((n[0], n[1]), came, (n[2], n[3]), (n[4], n[5]), kept_ns, (n[6], n[7]), n[8], stands)
            for name, n, came, stands, kept_ns in rows
        }
        self._stamp_ns = int(state["stamp_ns"])


def _numbers(way: _Way) -> tuple[float, ...]:
    return (*way.origin, *way.steady, *way.velocity, *way.place, way.radius_m)
