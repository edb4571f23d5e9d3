"""Clearance-manifold navigation: predict the field, continue a curve along its ridge, follow it.

Source: Cui, Deng, Wang, Clearance Deformation, Not Object Tracking: Manifold Continuation for Safe Navigation under Limited
Egocentric Sensing.  README.md beside this file says what differs and why.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2, wrap_angle
from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, Belief
from estimators.field_query import sample
from planners.clearance_manifold.chart import Chart, lay_chart
from planners.clearance_manifold.control_kernels import brakable, known_length
from planners.clearance_manifold.controller import ManifoldController, Situation
from planners.clearance_manifold.diagnostics import ManifoldDiagnostics
from planners.clearance_manifold.extraction import Scene, Solver
from planners.clearance_manifold.manifold import Manifold, Stations
from planners.clearance_manifold.prediction import ArrivalField, Predicted
from planners.clearance_manifold.properties import Properties, check
from planners.clearance_manifold.ridge_kernels import Ground, Sections
from planners.clearance_manifold.settings import ClearanceManifoldSettings
from planners.clearance_manifold.tracker import Continuation, Tracker, heading
from planners.clearance_manifold.warm_up import rehearse
from planners.planner import Drawing, Plan, PlannerSetup
from planners.router import Route

LOOK_AT_MOST_DEG = 120.0  # what closes in from behind is not turned to
UNKNOWN_GAP_M = 0.15  # shorter stretches of unknown cells are holes in a depth image, not the edge of what was seen


class ClearanceManifold:
    """Clearance manifold: follows the ridge of the clearance that will be there on arrival, continued from frame to frame."""

    Settings = ClearanceManifoldSettings
    default_shield: ClassVar[str] = "field_cbf"

    def __init__(self, settings: ClearanceManifoldSettings, setup: PlannerSetup) -> None:
        """Set everything up.

        Raises:
            ConfigurationError: there is no base.
        """
        if setup.limits is None:
            raise ConfigurationError("planner.name 'clearance_manifold' drives a base, but the robot has none")
        self._settings, self._setup, self._limits = settings, setup, setup.limits
        self._stations = Stations.of(settings.solver)
        self._field = ArrivalField(settings.prediction)
        self._solver = Solver(settings.solver, settings.tracker, self._stations, setup.robot_radius_m, setup.period_s)
        self._tracker = Tracker(settings.tracker, settings.solver, self._solver, self._stations, setup.period_s)
        self._controller = ManifoldController(settings.controller, setup.limits)
        self._chart: Chart | None = None
        self._arc_m = 0.0  # of the robot on the chart
        self._ticks = np.zeros(2, np.int64)  # continued, all
        self._asked = BodyTwist()  # at the tick before
        smoothing_s = settings.controller.smoothing_s
        self._share = 1.0 - math.exp(-setup.period_s / smoothing_s) if smoothing_s > 0.0 else 1.0

    def warm_up(self) -> None:
        """Compile every kernel, on a scene of its own."""
        self._field.warm_up()
        rehearse(type(self)(self._settings, self._setup))

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the twist along the manifold; zero, with the reason, where there is nothing to follow."""
        predicted = self._field.update(belief)
        reason = self._refusal(belief, route)
        if reason:
            self._chart = None
            self._tracker.reset()
            self._asked = BodyTwist()
            return Plan(BodyTwist(), diagnostics=ManifoldDiagnostics(fallback_category="", stopped=reason))
        pose = belief.odom_from_base
        point = self._control_point(pose)
        new_goal = self._follow_route(route, point)
        assert self._chart is not None
        scene = self._scene(self._chart, predicted, belief, point)
        told = self._tracker.advance(scene, belief, new_goal)
        situation = self._situation(told, belief, point, predicted.closing)
        twist, speed = self._controller.command(situation, pose.yaw)
        self._asked = self._smoothed(twist)
        return self._plan(scene, told, situation, self._asked, speed)

    def _smoothed(self, twist: BodyTwist) -> BodyTwist:
        """Return the twist a share of the way from the one asked before."""
        last, share = self._asked, self._share
        return BodyTwist(last.vx + share * (twist.vx - last.vx), last.vy + share * (twist.vy - last.vy), twist.wz)

    def _refusal(self, belief: Belief, route: Route) -> str:
        """Return why there is nothing to do, or nothing."""
        pose = belief.odom_from_base
        if route.empty or route.goal_in_odom is None:
            return "the way is blocked" if route.blocked else "no goal"
        here = np.array([[pose.x, pose.y]])
        if float(sample(belief.clearance.clearance_m, belief.clearance.lattice, here)[0]) <= 0.0:
            return "inside an obstacle"
        if math.hypot(route.goal_in_odom[0] - pose.x, route.goal_in_odom[1] - pose.y) < self._settings.controller.arrival_m:
            return "arrived"
        return ""

    def _control_point(self, pose: SE2) -> F64:
        """Return the point that follows the manifold, shape (2,): the centre, or one ahead of a base that cannot strafe."""
        ahead_m = 0.0 if self._limits.holonomic else self._settings.controller.look_ahead_m
        return np.array([pose.x + ahead_m * math.cos(pose.yaw), pose.y + ahead_m * math.sin(pose.yaw)])

    def _follow_route(self, route: Route, point: F64) -> bool:
        """Keep the chart, or lay a new one where the route left it; return whether the goal is another."""
        assert route.goal_in_odom is not None
        goal = np.array(route.goal_in_odom)
        moved_m = math.inf if self._chart is None else float(np.hypot(*(goal - self._chart.goal)))
        if self._chart is not None and moved_m < self._settings.chart.escape_m:
            self._arc_m = float(self._chart.project(point[None], self._arc_m)[0, 0])
            ahead = self._chart.project(route.path_in_odom[::4], self._arc_m)
            near = ahead[:, 0] <= self._arc_m + self._settings.solver.horizon_m
            if moved_m < 0.05 and not (np.abs(ahead[near, 1]) > self._settings.chart.escape_m).any():
                return False
        behind = self._behind(point)
        self._chart = lay_chart(route.path_in_odom, goal, behind, self._settings.chart)
        self._arc_m = float(self._chart.project(point[None])[0, 0])
        self._tracker.rechart(self._chart)
        return moved_m > self._settings.tracker.goal_jump_m

    def _behind(self, point: F64) -> F64:
        """Return the centre line behind the robot, for a new chart to join, shape (n, 2)."""
        if self._chart is None:
            return np.zeros((0, 2))
        arcs = np.arange(self._arc_m - self._settings.solver.rear_m, self._arc_m - 0.3, 0.1)
        return self._chart.frames(arcs, 1.0)[0]

    def _scene(self, chart: Chart, predicted: Predicted, belief: Belief, point: F64) -> Scene:
        lattice, s = belief.clearance.lattice, self._settings.solver
        arcs_m = self._arc_m + self._stations.arcs_m
        sections = Sections(*chart.frames(arcs_m, s.half_width_m))
        age_s = sample(self._field.age_s, lattice, sections.at)
        confidence = np.exp(-age_s / self._settings.prediction.confidence_decay_s)
        own = self._stations.own
        lateral_m = float((point - sections.at[own]) @ sections.normal[own])
        return Scene(
            Ground(predicted.clearance_m, lattice.x_m, lattice.y_m, lattice.cell_m),
            sections,
            arcs_m,
            confidence,
            lateral_m,
            point,
            self._end(chart),
            predicted.speed_m_s,
            predicted.closing,
        )

    def _end(self, chart: Chart) -> int:
        """Return the index of the first station beyond the goal; the robot's own and the next always count."""
        left_m = chart.length_m - self._arc_m
        return max(self._stations.own + 2, int(np.searchsorted(self._stations.arcs_m, left_m, side="right")))

    def _situation(self, told: Continuation, belief: Belief, point: F64, closing: F64) -> Situation:
        """Project the robot onto the manifold and read what the controller needs."""
        manifold, own, s = told.manifold, self._stations.own, self._settings.controller
        tangent = manifold.tangent()
        off = point - manifold.points[own]
        error = off - float(off @ tangent) * tangent
        clearance = manifold.clearance_m[manifold.ahead]
        near = clearance[manifold.arcs_m[manifold.ahead] <= manifold.arcs_m[own] + s.heading_look_ahead_m]
        look = max(2, int(np.searchsorted(self._stations.arcs_m[own:], s.heading_look_ahead_m)) + 1)
        return Situation(
            error=error,
            tangent=tangent,
            ridge_clearance_m=float(near.min()) if near.size else 0.0,
            margin_m=float(clearance.min()) - self._solver.least_m if clearance.size else 0.0,
            commitment=self._commitment(manifold, belief),
            free_m=self._free_length(manifold, belief),
            heading_rad=self._look(heading(manifold.points[own : own + look]), closing, point),
            feasible=manifold.valid > 1,
            robot=point,
            closing=closing,
        )

    def _look(self, along_rad: float, closing: F64, point: F64) -> float:
        """Return where to look: along the manifold, but turned as far as it takes to keep in view what closes in."""
        if closing[4] == 0.0:
            return along_rad
        s = self._settings
        room_rad = math.radians(max(0.0, 0.5 * s.prediction.fov_deg - s.controller.view_margin_deg))
        off_rad = wrap_angle(math.atan2(closing[1] - point[1], closing[0] - point[0]) - along_rad)
        if abs(off_rad) > math.radians(LOOK_AT_MOST_DEG):
            return along_rad
        return along_rad + math.copysign(max(0.0, abs(off_rad) - room_rad), off_rad)

    def _commitment(self, manifold: Manifold, belief: Belief) -> float:
        """Return a_pred, the largest share of the prediction with which all of the manifold keeps rho_min."""
        if not manifold.valid:
            return 0.0
        now = sample(belief.clearance.clearance_m, belief.clearance.lattice, manifold.points[manifold.ahead])
        then, least = manifold.clearance_m[manifold.ahead], self._solver.least_m
        short = then < least
        if not short.any():
            return 1.0
        spare, loss = np.maximum(now - least, 0.0)[short], np.maximum(now - then, 1e-9)[short]
        return float(min(max(float(np.min(spare / loss)), 0.0), 1.0))

    def _free_length(self, manifold: Manifold, belief: Belief) -> float:
        """Return how far ahead the robot may get: the end of what is wide enough, known, and on this side of the goal."""
        assert self._chart is not None
        s, lattice = self._settings.controller, belief.clearance.lattice
        if manifold.valid == 0:
            return 0.0
        corner = np.array([lattice.x_m, lattice.y_m])
        known_m = known_length(
            belief.clearance.known, corner, lattice.cell_m, manifold.points[manifold.own :], s.body_m, UNKNOWN_GAP_M
        )
        goal_m = max(0.0, self._chart.length_m - self._arc_m)
        reach_m = math.inf if manifold.whole else manifold.reach_m
        return float(min(reach_m, max(0.0, known_m - s.body_m), goal_m))

    def _plan(self, scene: Scene, told: Continuation, at: Situation, twist: BodyTwist, speed: float) -> Plan:
        s, manifold = self._settings, told.manifold
        error_m = float(np.hypot(*at.error))
        stops = speed <= brakable(at.free_m, s.controller.deceleration_m_s2, s.controller.delay_s) + 1e-9
        held = check(
            told, least_m=self._solver.least_m, lipschitz_m_s=s.tracker.lipschitz_m_s,
            lateral_gain_per_s=s.controller.lateral_gain_per_s, error_m=error_m, stops=stops,
        )  # fmt: skip
        tracking = told.category.value == "none"
        self._ticks += (int(tracking), 1)
        diagnostics = self._diagnostics(told, at, held, speed, error_m)
        return Plan(
            twist, path_in_odom=manifold.points[manifold.ahead], diagnostics=diagnostics, drawings=_drawn(scene, manifold)
        )

    def _diagnostics(
        self, told: Continuation, at: Situation, held: Properties, speed: float, error_m: float
    ) -> ManifoldDiagnostics:
        return ManifoldDiagnostics(
            fallback_category=told.category.value,
            trigger=told.trigger,
            stopped="" if told.manifold.valid else "no passage is wide enough here",
            tracking=told.category.value == "none",
            utilisation=float(self._ticks[0] / self._ticks[1]),
            deviation_m=told.deviation_m,
            reach_m=told.manifold.reach_m,
            free_m=at.free_m,
            rho_ridge_m=at.ridge_clearance_m,
            margin_m=at.margin_m,
            commitment=at.commitment,
            speed_m_s=speed,
            error_m=error_m,
            bound_m=told.normal_speed_m_s / self._settings.controller.lateral_gain_per_s,
            p1=held.p1_traversable,
            p2=held.p2_progress,
            p3=held.p3_branch,
            p4=held.p4_regular,
            p5=held.p5_reach,
            p6=held.p6_termination,
        )

    def snapshot(self) -> bytes:
        """Return the whole state."""
        chart = self._chart
        return pack(
            line=np.zeros((0, 2)) if chart is None else chart.line,
            goal=np.zeros(2) if chart is None else chart.goal,
            arc_m=self._arc_m,
            ticks=self._ticks,
            asked=(self._asked.vx, self._asked.vy, self._asked.wz),
            **self._field.state(),
            **self._tracker.state(),
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        self._chart = Chart(state["line"], state["goal"]) if len(state["line"]) else None
        self._arc_m, self._ticks = float(state["arc_m"]), state["ticks"]
        self._asked = BodyTwist(*state["asked"].tolist())
        self._field.take(state)
        self._tracker.take(state)


def _drawn(scene: Scene, manifold: Manifold) -> tuple[Drawing, ...]:
    """Return centre line, ridge and box, where there is one."""
    at, normal, reach = (part[manifold.ahead] for part in scene.sections)
    lines = (
        ("centre_line", scene.sections.at),
        ("ridge", at + manifold.ridge_m[manifold.ahead, None] * normal),
        ("box_right", at + np.maximum(manifold.low_m[manifold.ahead], reach[:, 0])[:, None] * normal),
        ("box_left", at + np.minimum(manifold.high_m[manifold.ahead], reach[:, 1])[:, None] * normal),
    )
    return tuple(Drawing(name, points) for name, points in lines)
