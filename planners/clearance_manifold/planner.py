"""Clearance-manifold navigation: predict the field, continue a curve along its ridge, follow it.

Source: Cui, Deng, Wang, Clearance Deformation, Not Object Tracking: Manifold Continuation for Safe Navigation under Limited
Egocentric Sensing.  README.md beside this file says what differs and why.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, Belief
from estimators.field_query import sample
from planners.clearance_manifold.chart import Chart, lay_chart
from planners.clearance_manifold.control_kernels import brakable
from planners.clearance_manifold.controller import ManifoldController, Situation
from planners.clearance_manifold.diagnostics import ManifoldDiagnostics, diagnose
from planners.clearance_manifold.drawings import drawn
from planners.clearance_manifold.extraction import Scene, Solver
from planners.clearance_manifold.governor import Around, Governor
from planners.clearance_manifold.lookout import Lookout, Outlook
from planners.clearance_manifold.lookout_kernels import Seen
from planners.clearance_manifold.manifold import Stations
from planners.clearance_manifold.passing import Passing
from planners.clearance_manifold.prediction import ArrivalField, Predicted
from planners.clearance_manifold.properties import check
from planners.clearance_manifold.reading import Reader, velocity_of
from planners.clearance_manifold.ridge_kernels import Ground, Sections
from planners.clearance_manifold.settings import ClearanceManifoldSettings
from planners.clearance_manifold.tracker import SECOND_NS, Category, Continuation, Tracker
from planners.clearance_manifold.waiting import Waiting
from planners.clearance_manifold.warm_up import rehearse
from planners.planner import Plan, PlannerSetup
from planners.polyline import arc_length
from planners.router import Route

TURN_M = 0.6  # a route that leads back within so much turns back


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
        self._field = ArrivalField(settings.prediction, setup.robot_radius_m)
        self._solver = Solver(settings.solver, settings.tracker, self._stations, setup)
        self._tracker = Tracker(settings.tracker, settings.solver, self._solver, self._stations, setup.period_s)
        self._reader = Reader(settings, self._stations, self._solver.least_m, strafes=setup.limits.holonomic)
        self._lookout = Lookout(settings.lookout, setup.limits, setup.robot_radius_m, settings.controller.speed_m_s)
        self._governor = Governor(settings.smoothness, setup.limits, setup.period_s)
        self._controller = ManifoldController(settings.controller, setup.limits, self._governor, setup.robot_radius_m)
        self._passing = Passing(self._solver, self._controller.apart_m, settings.controller.speed_m_s)
        self._waiting = Waiting(settings.waiting, setup.limits.velocity.wz)
        self._chart: Chart | None = None
        self._arc_m = 0.0  # of the robot on the chart
        self._escapes_ns = 0  # since when the route leaves it; 0: it does not
        self._ticks = np.zeros(2, np.int64)  # continued, all

    def warm_up(self) -> None:
        """Compile every kernel, on a scene of its own."""
        self._field.warm_up()
        self._passing.warm_up()
        type(self)(self._settings, self._setup)._governor.warm_up()
        rehearse(type(self)(self._settings, self._setup))

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the twist along the manifold; zero, with the reason, where there is nothing to follow."""
        predicted = self._field.update(belief)
        reason = self._refusal(belief, route)
        if reason:
            return self._wait(belief, predicted, route, reason)
        self._waiting.over()
        pose = belief.odom_from_base
        point = self._control_point(pose)
        new_goal = self._follow_route(route, point, predicted.closing, belief.stamp_ns)
        assert self._chart is not None
        scene = self._scene(self._chart, predicted, belief, point)
        hands, scene = self._passing.update(scene, velocity_of(belief), predicted.begins)
        told = self._tracker.advance(scene, belief, new_goal)
        outlook = self._outlook(scene, told, belief)
        left_m = self._chart.length_m - self._arc_m
        situation = self._reader.situation(
            told.manifold, belief, point, left_m, predicted.closing, hands, outlook, self._field.met_s
        )
        around = Around(scene.ground, belief.clearance.known, self._solver.least_m, self._settings.controller.body_m)
        twist, speed = self._controller.command(situation, pose.yaw, around)
        return self._plan(scene, told, situation, outlook, (twist, speed))

    def _wait(self, belief: Belief, predicted: Predicted, route: Route, reason: str) -> Plan:
        """Stand; where the way is blocked, look whether it still is, and make way for who comes along the last one."""
        self._tracker.reset()
        self._lookout.reset()
        blocked, s = route.blocked and self._chart is not None, self._settings
        come, twist = np.zeros((0, 5)), BodyTwist()
        if blocked and route.goal_in_odom is not None and s.waiting.blocked == "make_way":
            come, twist = self._make_way(belief, predicted)
        if not len(come):
            self._controller.reset()
        if not blocked:
            self._passing.reset()
            self._chart = None
        if self._chart is not None and (self._limits.holonomic or twist.vx == 0.0):  # what cannot strafe steers out of the way
            wz = self._waiting.turn(self._chart, self._arc_m, s.solver.horizon_m, self._solver.least_m, belief, come)
            twist = replace(twist, wz=wz)
        return Plan(twist, diagnostics=ManifoldDiagnostics(fallback_category="", stopped=reason))

    def _make_way(self, belief: Belief, predicted: Predicted) -> tuple[F64, BodyTwist]:
        """Return who comes along the last way or across it, shape (n, 5), and the twist that gives way to them."""
        assert self._chart is not None
        pose = belief.odom_from_base
        point = self._control_point(pose)
        self._arc_m = float(self._chart.project(point[None], self._arc_m)[0, 0])
        scene = self._scene(self._chart, predicted, belief, point)
        hands, scene = self._passing.update(scene, velocity_of(belief), predicted.begins)
        if not hands.any():
            return np.zeros((0, 5)), BodyTwist()
        around = Around(scene.ground, belief.clearance.known, self._solver.least_m, self._settings.controller.body_m)
        twist, _ = self._controller.command(self._reader.standing(scene, belief, hands), pose.yaw, around)
        return scene.closing[hands != 0.0], twist

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

    def _follow_route(self, route: Route, point: F64, closing: F64, stamp_ns: int) -> bool:
        """Keep the chart, or lay a new one where the route left it; return whether the goal is another.

        The route leads around what closes in, shape (n, 5), as if it stood: a chart laid along it now would keep that detour.
        """
        assert route.goal_in_odom is not None
        goal = np.array(route.goal_in_odom)
        moved_m = math.inf if self._chart is None else float(np.hypot(*(goal - self._chart.goal)))
        if self._chart is not None and moved_m < self._settings.chart.escape_m:
            self._arc_m = float(self._chart.project(point[None], self._arc_m)[0, 0])
            escapes = not closing[:, 4].any() and self._escapes(self._chart, route.path_in_odom)
            self._escapes_ns = (self._escapes_ns or stamp_ns) if escapes else 0
            left = escapes and stamp_ns - self._escapes_ns >= round(self._settings.chart.escape_s * SECOND_NS)
            if moved_m < 0.05 and not left:
                return False
        self._escapes_ns = 0
        behind = self._behind(point, route.path_in_odom)
        self._chart = lay_chart(route.path_in_odom, goal, behind, self._settings.chart)
        self._arc_m = float(self._chart.project(point[None])[0, 0])
        self._tracker.rechart(self._chart)
        return moved_m > self._settings.tracker.goal_jump_m

    def _escapes(self, chart: Chart, path: F64) -> bool:
        """Return whether a route, shape (n, 2), leaves the chart's tube within the horizon."""
        reach_m = self._settings.solver.horizon_m
        near = path[arc_length(path) <= reach_m][::4]
        offset_m = chart.project(near, self._arc_m, reach_m + 1.0)[:, 1]
        return bool((np.abs(offset_m) > self._settings.chart.escape_m).any())

    def _behind(self, point: F64, path: F64) -> F64:
        """Return the centre line behind the robot, for a new chart to join, shape (n, 2).

        None where the route, shape (m, 2), turns back: smoothed, such a chart is a hairpin whose tip lies behind the robot and
        whose tangent there leads anywhere.
        """
        nothing = np.zeros((0, 2))
        if self._chart is None:
            return nothing
        arcs = np.arange(self._arc_m - self._settings.solver.rear_m, self._arc_m - 0.3, 0.1)
        behind = self._chart.frames(arcs, 1.0)[0]
        onward = path[np.searchsorted(arc_length(path), TURN_M, side="right") - 1] - point
        return behind if float(onward @ (point - behind[-1])) >= 0.0 else nothing

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
            self._settings.prediction.nominal_speed_m_s,
            predicted.closing,
        )

    def _end(self, chart: Chart) -> int:
        """Return the index of the first station beyond the goal; the robot's own and the next always count."""
        left_m = chart.length_m - self._arc_m
        return max(self._stations.own + 2, int(np.searchsorted(self._stations.arcs_m, left_m, side="right")))

    def _outlook(self, scene: Scene, told: Continuation, belief: Belief) -> Outlook:
        """Return what unseen walkers leave of the way along the manifold."""
        assert self._chart is not None
        field, arcs_m = belief.clearance, self._arc_m + self._lookout.arcs_m
        at, normal, _ = self._chart.frames(arcs_m, 1.0)
        way = at + np.interp(arcs_m, scene.arcs_m, told.manifold.offset_m)[:, None] * normal
        lattice = field.lattice
        seen = Seen(field.known, field.clearance_m, self._field.age_s, lattice.x_m, lattice.y_m, lattice.cell_m)
        along_m_s = max(0.0, float(velocity_of(belief) @ told.manifold.tangent()))
        return self._lookout.watch(seen, way, normal, along_m_s, self._setup.period_s)

    def _plan(self, scene: Scene, told: Continuation, at: Situation, outlook: Outlook, command: tuple[BodyTwist, float]) -> Plan:
        s, manifold, (twist, speed) = self._settings, told.manifold, command
        stops = speed <= brakable(min(at.free_m, at.clear_m), s.controller.deceleration_m_s2, s.controller.delay_s) + 1e-9
        gain = s.controller.lateral_gain_per_s
        held = check(
            told, least_m=self._solver.least_m, lipschitz_m_s=s.tracker.lipschitz_m_s,
            lateral_gain_per_s=gain, error_m=float(np.hypot(*at.error)), stops=stops,
        )  # fmt: skip
        self._ticks += (int(told.category is Category.NONE), 1)
        said = diagnose(told, at, held, outlook, speed, gain, float(self._ticks[0] / self._ticks[1]))
        drawings = drawn(scene, manifold, self._tracker.tube_m, at.closing, outlook.look_at)
        return Plan(twist, path_in_odom=manifold.points[manifold.ahead], diagnostics=said, drawings=drawings)

    def snapshot(self) -> bytes:
        """Return the whole state."""
        chart = self._chart
        return pack(
            line=np.zeros((0, 2)) if chart is None else chart.line,
            goal=np.zeros(2) if chart is None else chart.goal,
            arc_m=self._arc_m,
            escapes_ns=self._escapes_ns,
            ticks=self._ticks,
            **self._field.state(),
            **self._tracker.state(),
            **self._passing.state(),
            **self._waiting.state(),
            **self._lookout.state(),
            **self._controller.state(),
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        self._chart = Chart(state["line"], state["goal"]) if len(state["line"]) else None
        self._arc_m, self._ticks, self._escapes_ns = float(state["arc_m"]), state["ticks"], int(state["escapes_ns"])
        self._field.take(state)
        self._tracker.take(state)
        self._passing.take(state)
        self._waiting.take(state)
        self._lookout.take(state)
        self._controller.take(state)
