"""Regulated pure pursuit: chase a point of the path, slower in curves, near obstacles and towards the end.

Source: Macenski, Singh, Martin, Gines, Regulated Pure Pursuit for Robot Path Tracking, Autonomous Robots 2023, and
nav2_regulated_pure_pursuit_controller.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BodyTwist
from drivers.interface.samples import frozen_array
from estimators.belief import Belief, Lattice
from estimators.field_query import sample
from planners.path_following import Task, limits_of, task_of
from planners.planner import Diagnostics, Drawing, Plan, PlannerSetup
from planners.regulated_pure_pursuit.kernels import approaching, carrot_on, collides_along, curvature_to, regulated
from planners.regulated_pure_pursuit.settings import RegulatedPurePursuitSettings
from planners.router import Route

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RegulatedPurePursuitDiagnostics(Diagnostics):
    """Where it aimed and what slowed it down."""

    lookahead_m: float = 0.0
    curvature_per_m: float = 0.0
    regulated_m_s: float = 0.0  # after curve and obstacles, before the approach
    rotating: bool = False  # on the spot, towards the path or the heading at the goal
    standing: str = ""  # why it stands, if it does


class RegulatedPurePursuit:
    """Regulated pure pursuit: drives the arc to a point of the route, slower in curves, near obstacles and towards the end."""

    Settings = RegulatedPurePursuitSettings
    default_shield: ClassVar[str] = "none"

    def __init__(self, settings: RegulatedPurePursuitSettings, setup: PlannerSetup) -> None:
        """Take the limits.

        Raises:
            ConfigurationError: there is no base.
        """
        self._settings, self._setup = settings, setup
        self._limits = limits_of(setup, "regulated_pure_pursuit")

    def warm_up(self) -> None:
        """Compile the kernels; a belief's arrays are read-only, which is a type of its own."""
        field = frozen_array(np.ones((3, 3), np.float32))
        sample(field, Lattice(0.0, 0.0, 1.0, 3, 3), np.zeros((1, 2)))
        carrot_on(np.zeros((2, 2)), 0.0, 0.0, 1.0)
        curvature_to(1.0, 0.0)
        regulated(1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.1)
        approaching(1.0, 1.0, 1.0, 1.0, 0.1)
        collides_along(np.zeros(3), 0.5, 0.1, 1.0, 1.0, 0.1, field, 0.0, 0.0, 1.0)

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the twist along the arc to the carrot; zero where that would collide, and where there is nothing to follow."""
        s = self._settings
        required_m = self._setup.robot_radius_m + s.margin_m
        task = task_of(
            belief, route, required_m, s.arrival_m, 2.0 * max(s.max_lookahead_m, s.approach_scaling_m), s.path_spacing_m
        )
        if task.standing:
            return Plan(BodyTwist(), diagnostics=RegulatedPurePursuitDiagnostics(standing=task.standing))
        if task.distance_m < s.arrival_m and task.turn_rad is not None:
            return self._rotate(task.turn_rad, belief, 0.0, ())
        lookahead_m = min(max(abs(belief.twist.vx) * s.lookahead_time_s, s.min_lookahead_m), s.max_lookahead_m)
        carrot = carrot_on(task.path, task.pose[0], task.pose[1], lookahead_m)
        steer = carrot
        if s.fixed_curvature_lookahead:
            steer = carrot_on(task.path, task.pose[0], task.pose[1], s.curvature_lookahead_m)
        drawn = (Drawing("lookahead", np.array([carrot]), connected=False),)
        ahead = belief.odom_from_base.inverse().apply(np.array(steer))
        aside_rad = math.atan2(ahead[1], ahead[0])
        if s.rotate_to_heading and abs(aside_rad) > s.rotate_min_angle_rad:
            return self._rotate(aside_rad, belief, lookahead_m, drawn)
        return self._pursue(task, belief, math.hypot(*(np.array(carrot) - task.pose[:2])), curvature_to(*ahead), drawn)

    def snapshot(self) -> bytes:
        """Return nothing: it has no state."""
        return b""

    def restore(self, snapshot: bytes) -> None:
        """Nothing to take over."""

    def _rotate(self, angle_rad: float, belief: Belief, lookahead_m: float, drawn: tuple[Drawing, ...]) -> Plan:
        """Return a turn on the spot, as fast as can still be stopped at the angle."""
        cap, acceleration = self._limits.velocity.wz, self._limits.acceleration.wz
        fastest = min(self._settings.rotate_rad_s, cap, math.sqrt(2.0 * acceleration * abs(angle_rad)))
        reach = acceleration * self._setup.period_s
        wz = min(max(math.copysign(fastest, angle_rad), belief.twist.wz - reach), belief.twist.wz + reach)
        diagnostics = RegulatedPurePursuitDiagnostics(lookahead_m, rotating=True)
        return Plan(BodyTwist(0.0, 0.0, min(max(wz, -cap), cap)), diagnostics=diagnostics, drawings=drawn)

    def _pursue(self, task: Task, belief: Belief, carrot_m: float, curvature: float, drawn: tuple[Drawing, ...]) -> Plan:
        """Return the twist along the arc; a base that cannot turn as fast as the arc asks drives it slower."""
        s, lattice, cap = self._settings, belief.clearance.lattice, self._limits.velocity
        field = belief.clearance.clearance_m
        clearance_m = float(sample(field, lattice, task.pose[None, :2])[0])
        admitted = regulated(
            min(s.max_speed_m_s, cap.vx), curvature, clearance_m, s.min_radius_m if s.regulate_by_curvature else 0.0,
            s.clearance_scaling_m if s.regulate_by_clearance else 0.0, s.clearance_gain, s.min_regulated_speed_m_s,
        )  # fmt: skip
        speed = approaching(admitted, task.left_m, task.distance_m, s.approach_scaling_m, s.min_approach_speed_m_s)
        turn = min(max(speed * curvature, -cap.wz), cap.wz)
        speed = speed if curvature == 0.0 else turn / curvature
        collides, arc = collides_along(
            task.pose, speed, turn, carrot_m, s.time_to_collision_s, task.required_m,
            field, lattice.x_m, lattice.y_m, lattice.cell_m,
        )  # fmt: skip
        twist = BodyTwist() if collides else BodyTwist(speed, 0.0, turn)
        diagnostics = RegulatedPurePursuitDiagnostics(
            carrot_m, curvature, admitted, standing="collision ahead on the arc" if collides else ""
        )
        return Plan(twist, path_in_odom=arc, diagnostics=diagnostics, drawings=(*drawn, Drawing("arc", arc)))
