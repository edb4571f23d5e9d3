"""The piece of the route that a band is laid along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.belief import F64
from planners.polyline import arc_length
from planners.teb.band import tangents


@dataclass(frozen=True, slots=True)
class Window:
    """From the robot some way along the route."""

    path: F64  # (m, 2), m >= 2, from the robot
    end_yaw: float  # the route's direction at its end
    stops: bool  # whether that is the route's own end


def window_of(route: F64, pose: F64, look_ahead_m: float) -> Window:
    """Return the route, shape (k, 2), from its point nearest to the robot, as far as the look-ahead reaches."""
    nearest = int(np.argmin(np.hypot(*(route - pose[:2]).T)))
    path = np.concatenate((pose[None, :2], route[min(nearest + 1, len(route) - 1) :]))
    along = arc_length(path)
    stops = bool(along[-1] <= look_ahead_m)
    if not stops:
        count = int(np.searchsorted(along, look_ahead_m))
        end = [np.interp(look_ahead_m, along, path[:, i]) for i in range(2)]
        path = np.concatenate((path[:count], [end]))
    return Window(path, float(tangents(path)[-1]), stops)
