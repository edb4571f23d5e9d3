"""What the viewer shows of a tick: centre line, manifold, ridge, box, tube, what closes in, what is looked at."""

from __future__ import annotations

import numpy as np

from estimators.belief import F64
from planners.clearance_manifold.extraction import Scene
from planners.clearance_manifold.manifold import Manifold
from planners.planner import Drawing

AHEAD_S = 1.0  # of the way that what closes in is drawn with


def drawn(scene: Scene, manifold: Manifold, tube_m: float, closing: F64, look_at: F64 | None) -> tuple[Drawing, ...]:
    """Return the drawings.

    Args:
        scene: what the manifold is laid through.
        manifold: the manifold.
        tube_m: radius of the tube that its stations are searched in.
        closing: what closes in, shape (n, 5).
        look_at: what is turned to, shape (2,), in odom.
    """
    ahead = manifold.ahead
    at, normal, reach = (part[ahead] for part in scene.sections)
    offset = manifold.offset_m[ahead, None]
    lines = [
        Drawing("centre_line", scene.sections.at),
        Drawing("manifold", manifold.points),
        Drawing("ridge", at + manifold.ridge_m[ahead, None] * normal),
        Drawing("box_right", at + np.maximum(manifold.low_m[ahead], reach[:, 0])[:, None] * normal),
        Drawing("box_left", at + np.minimum(manifold.high_m[ahead], reach[:, 1])[:, None] * normal),
        Drawing("tube_right", at + (offset - tube_m) * normal),
        Drawing("tube_left", at + (offset + tube_m) * normal),
    ]
    come = closing[closing[:, 4] > 0.0]
    ways = np.stack((come[:, :2], come[:, :2] + AHEAD_S * come[:, 2:4]), axis=1)
    lines.extend(Drawing("closing", way) for way in ways)
    if look_at is not None:
        lines.append(Drawing("looked_at", look_at[None], connected=False))
    return tuple(lines)
