"""Tracks that are the truth: for evaluation of planners apart from perception, chosen by the configuration only."""

from __future__ import annotations

import math

import numpy as np

from drivers.interface.geometry import SE2
from drivers.interface.samples import TruthSample, frozen_array
from estimators.belief import Track


def tracks_from_truth(truth: TruthSample, odom_from_map: SE2) -> tuple[Track, ...]:
    """Return every obstacle as a disc of its bounding radius; its place in the sample is its identity."""
    c, s = math.cos(odom_from_map.yaw), math.sin(odom_from_map.yaw)
    tracks = []
    for identity, obstacle in enumerate(truth.obstacles):
        place = odom_from_map @ obstacle.map_from_obstacle
        vx, vy = obstacle.velocity_m_s
        velocity = (c * vx - s * vy, s * vx + c * vy)
        tracks.append(Track(identity, (place.x, place.y), velocity, obstacle.radius_m, frozen_array(np.zeros((4, 4)))))
    return tuple(tracks)
