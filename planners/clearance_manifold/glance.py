"""Looking round: who comes from behind is seen by nobody who only looks where he goes.

Beyond the paper.  Directions around the robot that are open and have been out of view for long are looked into, one after the
other; meanwhile it stands.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import SE2, wrap_angle
from estimators.belief import F64, ClearanceField
from estimators.field_query import sample
from planners.clearance_manifold.settings import GlanceSettings

DIRECTIONS = 16
EDGE_RAD = math.radians(10.0)  # nearer than this to the edge of view nobody is made out
STEP_M = 0.1
NEAR_M = 0.3  # the robot's own ground and what it may stand beside


class Glance:
    """Since when each direction, in odom, has been out of view, and the one that is turned to."""

    def __init__(self, settings: GlanceSettings, fov_rad: float) -> None:
        """Take the settings and what the camera sees."""
        self._settings, self._half_rad = settings, 0.5 * fov_rad - EDGE_RAD
        self._angles = 2.0 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS - math.pi
        self._arcs_m = np.arange(NEAR_M, settings.open_m, STEP_M)
        self._unseen_s: F64 = np.zeros(DIRECTIONS)
        self._due: NDArray[np.bool_] = np.zeros(DIRECTIONS, np.bool_)  # of this round
        self._rested_s = math.inf  # since the last round

    def see(self, yaw: float, elapsed_s: float) -> None:
        """Take in where the robot looks."""
        if not self._settings.enabled:
            return
        self._unseen_s = np.where(self._off(yaw) <= self._half_rad, 0.0, self._unseen_s + elapsed_s)
        self._rested_s += elapsed_s

    def direction(self, pose: SE2, field: ClearanceField, *, allowed: bool, enters: bool) -> float | None:
        """Return the direction to look into now [rad, odom], or nothing.

        Args:
            pose: of the robot, in odom.
            field: what stands around it.
            allowed: whether it is a place to stand and look from.
            enters: whether its way leads to where somebody walks.
        """
        s = self._settings
        if not s.enabled or not allowed:
            self._due[:] = False
            return None
        looks = bool(self._due.any())
        self._due &= self._unseen_s > 0.0
        if not looks and self._rested_s > s.rest_s:
            self._due = (self._unseen_s > (s.before_s if enters else s.every_s)) & self._opens(pose, field)
        if not self._due.any():
            self._rested_s = 0.0 if looks else self._rested_s
            return None
        return wrap_angle(float(self._angles[int(np.argmin(np.where(self._due, self._off(pose.yaw), math.inf)))]))

    def _off(self, yaw: float) -> F64:
        return np.asarray(np.abs(np.mod(self._angles - yaw + math.pi, 2.0 * math.pi) - math.pi))

    def _opens(self, pose: SE2, field: ClearanceField) -> NDArray[np.bool_]:
        """Return into which directions nothing stands in the way as far as somebody matters, shape (DIRECTIONS,)."""
        rays = self._arcs_m[None, :, None] * np.stack((np.cos(self._angles), np.sin(self._angles)), axis=1)[:, None, :]
        points = np.array([pose.x, pose.y]) + rays.reshape(-1, 2)
        clearance = sample(field.clearance_m, field.lattice, points).reshape(DIRECTIONS, -1)
        return np.asarray((clearance > field.lattice.cell_m).all(axis=1))

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is carried on, as named arrays."""
        return {"glance": np.concatenate((self._unseen_s, self._due, (self._rested_s,)))}

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._unseen_s, self._due = state["glance"][:DIRECTIONS].copy(), state["glance"][DIRECTIONS:-1] > 0.0
        self._rested_s = float(state["glance"][-1])
