"""The true plan of the floor: how far a place is from what really stands or walks there, and how far one sees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import SE2
from sim_drivers.scene import Kind, Shape

F64 = NDArray[np.float64]
STEPS = 60  # of a line of sight; one that grazes a wall takes the most
TOUCH_M = 0.002  # so near to a surface counts as there


@dataclass(frozen=True, slots=True)
class FloorPlan:
    """Footprints in the map."""

    solids: tuple[tuple[Shape, SE2], ...]

    def distance_m(self, points: F64) -> F64:
        """Return the signed distances, shape (n,), of points in the map, shape (n, 2), from the nearest footprint.

        >>> FloorPlan(((Shape.cylinder(0.5, 1.0), SE2(2.0, 0.0)),)).distance_m(np.array([[0.0, 0.0], [2.0, 0.0]])).tolist()
        [1.5, -0.5]
        """
        nearest = np.full(len(points), np.inf)
        for shape, pose in self.solids:
            nearest = np.minimum(nearest, _signed_distance(shape, pose.inverse().apply(points)))
        return nearest

    def sight_m(self, eye: F64, bearings: F64, reach_m: float) -> F64:
        """Return how far one sees from the eye, shape (2,), at bearings [rad], shape (n,); at most `reach_m`.

        Each line of sight is walked along in steps that are as long as the way to the nearest surface (Hart, Sphere tracing: a
        geometric method for the antialiased ray tracing of implicit surfaces, The Visual Computer 12, 1996).
        """
        rays = np.stack((np.cos(bearings), np.sin(bearings)), axis=-1)
        gone_m = np.zeros(len(bearings))
        for _ in range(STEPS):
            step = self.distance_m(eye + gone_m[:, None] * rays)
            if (np.abs(step[gone_m < reach_m]) < TOUCH_M).all():
                break
            gone_m = np.minimum(gone_m + np.maximum(step, 0.0), reach_m)
        return gone_m


def _signed_distance(shape: Shape, local: F64) -> F64:
    half_x, half_y, _ = shape.half_extents_m
    if shape.kind is Kind.CYLINDER:
        return np.asarray(np.hypot(local[:, 0], local[:, 1]) - half_x)
    over = np.abs(local) - (half_x, half_y)
    return np.asarray(np.linalg.norm(np.maximum(over, 0.0), axis=1) + np.minimum(over.max(axis=1), 0.0))
