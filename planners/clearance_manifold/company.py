"""Among people who walk up and down: where the robot keeps to, where it waits, and when it looks round.

Beyond the paper.  It keeps beside the lines that somebody walks along (`passers`), crosses them when nobody comes, waits beside
them and not in doorways, and looks round (`glance`) where it may stand.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.belief import F64, Belief
from estimators.field_query import sample
from planners.clearance_manifold.chart import Chart
from planners.clearance_manifold.extraction import Scene
from planners.clearance_manifold.glance import Glance
from planners.clearance_manifold.lookout import Outlook
from planners.clearance_manifold.manifold import Manifold
from planners.clearance_manifold.passers import Passers
from planners.clearance_manifold.ridge_kernels import Ground, beside, walls
from planners.clearance_manifold.settings import ClearanceManifoldSettings

ENTERS_M = 0.8  # of the way ahead that is looked at for where somebody walks
BEFORE_M = 0.1  # so far before it the robot stops
DOORWAY_M, DOOR_M = 1.5, 0.15  # doorways are looked for so far, and so far off their walls it neither waits nor looks round
ASIDE_M, ASIDE_M_S = 0.1, 0.25  # so much room, and so fast, where it waits for the way to open


class Company:
    """Knows who was about and what was looked at."""

    def __init__(self, settings: ClearanceManifoldSettings, radius_m: float, kept_m: float) -> None:
        """Take the settings, the robot's radius and the clearance that the shield keeps."""
        self._settings, self._radius_m, self._kept_m = settings, radius_m, kept_m
        self._passers = Passers(settings.passers)
        self._glance = Glance(settings.glance, math.radians(settings.prediction.fov_deg))

    def update(self, belief: Belief, period_s: float) -> None:
        """Take in who walks and where the robot looks."""
        self._passers.update(belief)
        self._glance.see(belief.odom_from_base.yaw, period_s)

    def walked(self, at: F64, normal: F64, ground: Ground, left_m: F64) -> F64:
        """Return what walkers take up of cross-sections (`Passers.across`); nothing where the goal, `left_m` ahead, is near."""
        taken = self._passers.across(at, normal, ground)
        taken[left_m < self._settings.passers.goal_m] = np.nan
        return taken

    def outlook(self, scene: Scene, manifold: Manifold, door_m: F64, belief: Belief, outlook: Outlook) -> Outlook:
        """Return the outlook with looking round, and waiting beside where somebody walks, not there and not in doorways.

        Args:
            scene: what the manifold is laid through.
            manifold: of this tick.
            door_m: how far ahead the way leads through doorways (`doorways`), shape (n,).
            belief: of this tick.
            outlook: what unseen walkers leave of the way.
        """
        own, points = manifold.own, manifold.points[manifold.ahead]
        ahead_m = manifold.arcs_m[manifold.ahead] - manifold.arcs_m[own]
        room = self._passers.aside(np.vstack((scene.robot, points)))[:, 0] - self._radius_m
        here_m = min(float(room[0]), beside(scene.sections, own, scene.robot_m) - self._radius_m)
        inside = room[1:] < 0.0
        enters_m = float(ahead_m[inside][0]) if inside.any() else math.inf
        stays = here_m >= 0.0 and not (np.abs(door_m) < self._radius_m + DOOR_M).any()
        glance_rad = self._glance.direction(belief.odom_from_base, belief.clearance, allowed=stays, enters=enters_m < ENTERS_M)
        if not stays:
            return Outlook()
        if enters_m < ENTERS_M and self._comes(points[inside], float(ahead_m[inside][-1])):
            outlook = replace(outlook, free_m=max(0.0, min(outlook.free_m, enters_m - BEFORE_M)), waits=True)
        before_m = door_m[door_m > 0.0] - self._radius_m - DOOR_M
        if outlook.waits and before_m.size:
            outlook = replace(outlook, free_m=min(outlook.free_m, float(before_m[0])))
        return replace(outlook, glance_rad=glance_rad)

    def _comes(self, points: F64, out_m: float) -> bool:
        """Return whether somebody is near points, shape (n, 2), before the robot is out, `out_m` ahead."""
        return self._passers.comes(points, out_m / self._settings.prediction.nominal_speed_m_s)

    def doorways(self, chart: Chart, arc_m: float, ground: Ground) -> F64:
        """Return how far ahead, negative behind, a chart leads through a doorway or another narrow place, shape (n,) [m]."""
        arcs_m = np.arange(-DOORWAY_M, DOORWAY_M, 0.1)
        at, normal, _ = chart.frames(arc_m + arcs_m, 1.0)
        narrowest_m = self._settings.passers.narrowest_m
        return np.asarray(arcs_m[walls(ground, at, normal, narrowest_m).sum(axis=1) < narrowest_m])

    def step_aside(self, belief: Belief) -> F64 | None:
        """Return the velocity, shape (2,), in odom, away from where somebody walks, for who stands and waits; nothing if none."""
        here = np.array([[belief.odom_from_base.x, belief.odom_from_base.y]])
        room_m, *away = self._passers.aside(here)[0].tolist()
        there = here + ASIDE_M * np.array(away)
        free_m = float(sample(belief.clearance.clearance_m, belief.clearance.lattice, there)[0])
        if room_m >= self._radius_m + ASIDE_M or free_m < self._kept_m:
            return None
        return np.asarray(ASIDE_M_S * np.array(away))

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is carried on, as named arrays."""
        return self._passers.state() | self._glance.state()

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._passers.take(state)
        self._glance.take(state)
