"""What is believed to move: a ring as large as each track, and an arrow to where it will be in a second."""

from __future__ import annotations

from typing import Any

import numpy as np
import rerun as rr

from estimators.belief import Track
from runtime.log.drawn import colours
from runtime.log.drawn.layers import IDENTICAL, Layer, Rows

_HEIGHT_M = 0.05  # just above the floor
_CIRCLE = np.stack([f(np.linspace(0.0, 2.0 * np.pi, 33)) for f in (np.cos, np.sin)], axis=1)  # (33, 2)


def layers(entity: str, period_ns: int) -> list[Layer[Any]]:
    """Return the layers below the entity, drawn once a period at most."""
    rings, arrows = f"{entity}/ring", f"{entity}/velocity"
    ring = rr.LineStrips3D.from_fields(colors=[colours.MOVING], radii=[0.012])
    arrow = rr.Arrows3D.from_fields(colors=[colours.MOVING], radii=[0.015])
    return [
        Layer(lambda c: c.belief.tracks, Rows(rings, _ring_columns, [(rings, ring)]), IDENTICAL, period_ns),
        Layer(lambda c: c.belief.tracks, Rows(arrows, _velocity_columns, [(arrows, arrow)]), IDENTICAL, period_ns),
    ]


def _ring_columns(rows: list[tuple[Track, ...]]) -> rr.ComponentColumnList:
    strips = [np.c_[t.position_in_odom + t.radius_m * _CIRCLE, np.full(len(_CIRCLE), _HEIGHT_M)] for row in rows for t in row]
    names = [f"track {track.identity}" for row in rows for track in row]
    return rr.LineStrips3D.columns(strips=strips, labels=names).partition([len(row) for row in rows])


def _velocity_columns(rows: list[tuple[Track, ...]]) -> rr.ComponentColumnList:
    found = [track for row in rows for track in row]
    return rr.Arrows3D.columns(
        origins=[(*track.position_in_odom, _HEIGHT_M) for track in found],
        vectors=[(*track.velocity_in_odom, 0.0) for track in found],
    ).partition([len(row) for row in rows])
