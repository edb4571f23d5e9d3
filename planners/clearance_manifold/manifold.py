"""The navigation manifold: a curve of stations, each a lateral offset from the centre line (equation 3)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from estimators.belief import F64
from planners.clearance_manifold.ridge_kernels import Sections
from planners.clearance_manifold.settings import SolverSettings


@dataclass(frozen=True, slots=True)
class Stations:
    """Where the stations stand relative to the robot's own, along the centre line."""

    arcs_m: F64  # (n,), increasing, 0 at the robot's own
    own: int  # index of that

    @classmethod
    def of(cls, settings: SolverSettings) -> Stations:
        """Return the rear ones, the own and the forward ones, evenly spaced each."""
        rear = np.linspace(-settings.rear_m, 0.0, settings.stations_rear + 1)[:-1]
        return cls(np.concatenate((rear, np.linspace(0.0, settings.horizon_m, settings.stations_forward + 1))), len(rear))


@dataclass(frozen=True, slots=True)
class Manifold:
    """One solution, at stations on a chart."""

    arcs_m: F64  # (n,), on the chart
    offset_m: F64  # (n,), y*
    points: F64  # (n, 2), in odom
    low_m: F64  # (n,), the box; infinite where nothing binds
    high_m: F64  # (n,)
    ridge_m: F64  # (n,), y_ridge; the offset itself where there is no box
    clearance_m: F64  # (n,), predicted, on the manifold
    valid: int  # stations from the robot's own on that have a box, without gap
    own: int
    whole: bool  # it goes to the goal, or as far as is looked

    @property
    def reach_m(self) -> float:
        """How far ahead it goes, along the centre line."""
        return float(self.arcs_m[self.own + self.valid - 1] - self.arcs_m[self.own]) if self.valid else 0.0

    @property
    def ahead(self) -> slice:
        """Its valid stations from the robot's own on."""
        return slice(self.own, self.own + self.valid)

    def tangent(self) -> F64:
        """Return the unit tangent at the robot's own station, shape (2,)."""
        along = self.points[self.own + 1] - self.points[self.own - 1]
        return np.asarray(along / max(math.hypot(along[0], along[1]), 1e-9))


def points_of(sections: Sections, offset_m: F64) -> F64:
    """Return the points at offsets, shape (n,), in odom, shape (n, 2)."""
    return np.asarray(sections.at + offset_m[:, None] * sections.normal)
