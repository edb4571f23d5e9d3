"""What layer 3 reads of a manifold: the 1-D quantities of proposition 3, at the robot."""

from __future__ import annotations

import math

import numpy as np

from drivers.interface.geometry import SE2, wrap_angle
from estimators.belief import F32, F64, Belief
from estimators.field_query import sample
from planners.clearance_manifold.closing import nearest_of
from planners.clearance_manifold.control_kernels import known_length
from planners.clearance_manifold.controller import UNKNOWN_GAP_M, Situation
from planners.clearance_manifold.extraction import Scene
from planners.clearance_manifold.lookout import Outlook
from planners.clearance_manifold.manifold import Manifold, Stations
from planners.clearance_manifold.settings import ClearanceManifoldSettings
from planners.clearance_manifold.tracker import heading

WAY_INSIDE_DEG = 10.0  # so far inside the edge of view the way ahead is kept while something else is watched
LOOK_AT_MOST_DEG = 120.0  # what closes in from behind is not turned to
TURNED_RAD = 0.1  # nearer than this it has turned
BEHIND_M = 1.0  # so far back is looked for room to back off


class Reader:
    """Projects the robot onto a manifold."""

    def __init__(self, settings: ClearanceManifoldSettings, stations: Stations, least_m: float, *, strafes: bool) -> None:
        """Take the settings, where the stations stand, rho_min, and whether the base can move while it looks aside."""
        self._settings, self._stations, self._least_m, self._strafes = settings, stations, least_m, strafes

    def situation(
        self,
        manifold: Manifold,
        belief: Belief,
        point: F64,
        left_m: float,
        closing: F64,
        hands: F64,
        outlook: Outlook,
        met_s: F32,
    ) -> Situation:
        """Return what the controller needs.

        Args:
            manifold: of this tick.
            belief: the field that it lies in.
            point: that follows it, in odom, shape (2,).
            left_m: to the end of the chart, the goal.
            closing: what closes in, shape (n, 5).
            hands: on which it passes, shape (n,).
            outlook: what unseen walkers leave of the way.
            met_s: how long ago each cell was looked at, shape (rows, columns).
        """
        own, s = self._stations.own, self._settings.controller
        tangent = manifold.tangent()
        off = point - manifold.points[own]
        clearance = manifold.clearance_m[manifold.ahead]
        near = clearance[manifold.arcs_m[manifold.ahead] <= manifold.arcs_m[own] + s.heading_look_ahead_m]
        look = max(2, int(np.searchsorted(self._stations.arcs_m[own:], s.heading_look_ahead_m)) + 1)
        along_rad = heading(manifold.points[own : own + look])
        stale = self._strafes and self._stale(manifold, belief, met_s)
        heading_rad = self._look(along_rad, closing, point, None if stale else outlook.look_at)
        stands = not self._strafes and self._looks_first(heading_rad, along_rad, belief.odom_from_base.yaw)
        return Situation(
            error=off - float(off @ tangent) * tangent,
            tangent=tangent,
            ridge_clearance_m=float(near.min()) if near.size else 0.0,
            margin_m=float(clearance.min()) - self._least_m if clearance.size else 0.0,
            commitment=self._commitment(manifold, belief),
            free_m=self._free_length(manifold, belief, left_m),
            clear_m=0.0 if stands and outlook.creeps else outlook.free_m,
            most_m_s=outlook.speed_m_s,
            heading_rad=heading_rad,
            feasible=manifold.valid > 1,
            robot=point,
            velocity=velocity_of(belief),
            closing=closing,
            hands=hands,
            behind_m=0.0 if self._strafes else self._behind(belief),
            stale=stale,
        )

    def standing(self, scene: Scene, belief: Belief, hands: F64) -> Situation:
        """Return what the controller needs to stand where it does, but for who comes, on these hands, shape (n,)."""
        own, yaw = self._stations.own, belief.odom_from_base.yaw
        x, y = scene.sections.normal[own].tolist()
        return Situation(
            error=np.zeros(2),
            tangent=np.array([y, -x]),
            ridge_clearance_m=0.0,
            margin_m=0.0,
            commitment=0.0,
            free_m=0.0,
            clear_m=0.0,
            most_m_s=0.0,
            heading_rad=yaw,
            feasible=False,
            robot=scene.robot,
            velocity=velocity_of(belief),
            closing=scene.closing,
            hands=hands,
            behind_m=0.0 if self._strafes else self._behind(belief),
        )

    def _stale(self, manifold: Manifold, belief: Belief, met_s: F32) -> bool:
        """Return whether the ground right before the robot, which is too near to be seen, was not looked at for long."""
        near_m, lattice = self._settings.prediction.near_m, belief.clearance.lattice
        corner, way = np.array([lattice.x_m, lattice.y_m]), np.empty((2, 2))
        way[0], tangent = manifold.points[manifold.own], manifold.tangent()
        way[1] = way[0] + (near_m + lattice.cell_m) * tangent
        met = met_s <= self._settings.controller.stale_s
        return bool(known_length(met, corner, lattice.cell_m, way, self._least_m, lattice.cell_m) < near_m)

    def _looks_first(self, heading_rad: float, along_rad: float, yaw: float) -> bool:
        """Return whether there is something to look at aside, and the base has not turned to it yet."""
        return abs(wrap_angle(heading_rad - along_rad)) > TURNED_RAD and abs(wrap_angle(heading_rad - yaw)) > TURNED_RAD

    def _behind(self, belief: Belief) -> float:
        """Return how far straight back the way is known and wide enough [m]."""
        pose, field = belief.odom_from_base, belief.clearance
        back = np.array([math.cos(pose.yaw), math.sin(pose.yaw)])
        points = np.array([pose.x, pose.y]) - np.arange(0.0, BEHIND_M, 0.5 * field.lattice.cell_m)[:, None] * back
        corner = np.array([field.lattice.x_m, field.lattice.y_m])
        known_m = known_length(field.known, corner, field.lattice.cell_m, points, self._settings.controller.body_m, UNKNOWN_GAP_M)
        short = np.flatnonzero(sample(field.clearance_m, field.lattice, points) < self._least_m)
        wide_m = BEHIND_M if not short.size else 0.5 * field.lattice.cell_m * float(short[0])
        return float(max(0.0, min(wide_m, known_m - self._settings.controller.body_m)))

    def _look(self, along_rad: float, closing: F64, point: F64, look_at: F64 | None) -> float:
        """Return where to look: along the manifold, but turned as far as it takes to keep in view what closes in, or may.

        Who closes in is not followed so far that the way ahead leaves the view.

        Args:
            along_rad: along the manifold, in odom.
            closing: what closes in, shape (n, 5).
            point: that is controlled, shape (2,).
            look_at: what else is to be seen, shape (2,), if anything.
        """
        off = closing[:, :2] - point
        come = closing[(closing[:, 4] > 0.0) & ((off * closing[:, 2:4]).sum(axis=1) < 0.0)]  # who has passed is not looked after
        comes, s = len(come) > 0, self._settings
        watched = nearest_of(come, point) if comes else look_at
        if watched is None:
            return along_rad
        turns_for_it = look_at is watched and not self._strafes  # it stands meanwhile: no degree more than it takes
        margin_deg = s.controller.look_margin_deg if turns_for_it else s.controller.view_margin_deg
        half_deg = 0.5 * s.prediction.fov_deg
        room_rad = math.radians(max(0.0, half_deg - margin_deg))
        off_rad = wrap_angle(math.atan2(watched[1] - point[1], watched[0] - point[0]) - along_rad)
        if abs(off_rad) > math.radians(LOOK_AT_MOST_DEG):
            return along_rad
        most_rad = math.radians(max(0.0, half_deg - WAY_INSIDE_DEG)) if comes else math.pi
        return along_rad + math.copysign(min(max(0.0, abs(off_rad) - room_rad), most_rad), off_rad)

    def _commitment(self, manifold: Manifold, belief: Belief) -> float:
        """Return a_pred, the largest share of the prediction with which all of the manifold keeps rho_min."""
        if not manifold.valid:
            return 0.0
        now = sample(belief.clearance.clearance_m, belief.clearance.lattice, manifold.points[manifold.ahead])
        then, least = manifold.clearance_m[manifold.ahead], self._least_m
        short = then < least
        if not short.any():
            return 1.0
        spare, loss = np.maximum(now - least, 0.0)[short], np.maximum(now - then, 1e-9)[short]
        return float(min(max(float(np.min(spare / loss)), 0.0), 1.0))

    def _free_length(self, manifold: Manifold, belief: Belief, left_m: float) -> float:
        """Return how far ahead the robot may get: the end of what is wide enough, known, and on this side of the goal."""
        s, lattice = self._settings.controller, belief.clearance.lattice
        if manifold.valid == 0:
            return 0.0
        corner = np.array([lattice.x_m, lattice.y_m])
        ahead = manifold.points[manifold.own :]
        known_m = known_length(belief.clearance.known, corner, lattice.cell_m, ahead, s.body_m, UNKNOWN_GAP_M)
        reach_m = math.inf if manifold.whole else manifold.reach_m
        return float(min(reach_m, max(0.0, known_m - s.body_m), max(0.0, left_m)))


def velocity_of(belief: Belief) -> F64:
    """Return the base's velocity, shape (2,), in odom [m/s]."""
    return np.asarray(SE2(0.0, 0.0, belief.odom_from_base.yaw).apply(np.array([belief.twist.vx, belief.twist.vy])))
