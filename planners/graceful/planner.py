"""The graceful controller: a smooth control law to the farthest point of the path that its own simulation reaches.

Source: Park, Kuipers, A smooth control law for graceful motion of differential wheeled mobile robots in 2D environment,
ICRA 2011, and nav2_graceful_controller.
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
from planners.graceful.kernels import Field, Law, choose, rotation
from planners.graceful.settings import GracefulSettings
from planners.path_following import Task, limits_of, task_of
from planners.planner import Diagnostics, Drawing, Plan, PlannerSetup
from planners.polyline import arc_length
from planners.router import Route

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class GracefulDiagnostics(Diagnostics):
    """Which target it chose."""

    target_m: float = 0.0  # along the path
    nearer_targets: int = 0  # tried after the farthest one could not be reached
    rotating: bool = False  # on the spot
    standing: str = ""  # why it stands, if it does


class Graceful:
    """Graceful controller: drives a smooth curve to the farthest point of the route that it can reach along one."""

    Settings = GracefulSettings
    default_shield: ClassVar[str] = "none"

    def __init__(self, settings: GracefulSettings, setup: PlannerSetup) -> None:
        """Take the limits.

        Raises:
            ConfigurationError: there is no base.
        """
        s, self._settings, self._required_m = settings, settings, setup.robot_radius_m + settings.margin_m
        cap = limits_of(setup, "graceful").velocity
        fastest, turn = min(s.max_speed_m_s, cap.vx), min(s.max_turn_rad_s, cap.wz)
        self._law = Law(
            s.k_phi, s.k_delta, s.beta, s.exponent, s.slowdown_radius_m, min(s.min_speed_m_s, fastest), fastest, turn,
            min(s.min_turn_rad_s, turn), s.rotation_gain, s.initial_rotation_tolerance_rad if s.initial_rotation else math.inf,
        )  # fmt: skip

    def warm_up(self) -> None:
        """Compile the kernels; a belief's arrays are read-only, which is a type of its own."""
        cleared = frozen_array(np.ones((3, 3), np.float32))
        sample(cleared, Lattice(0.0, 0.0, 1.0, 3, 3), np.zeros((1, 2)))
        choose(np.zeros(3), np.ones((1, 3)), True, self._law, Field(cleared, 0.0, 0.0, 1.0, 0.1), 0, np.empty((4, 3)))
        rotation(1.0, self._law)

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the control law's twist to the chosen target; zero where it reaches none or there is nothing to follow."""
        s = self._settings
        task = task_of(belief, route, self._required_m, s.arrival_m, s.max_lookahead_m, s.path_spacing_m)
        if task.standing:
            return Plan(BodyTwist(), diagnostics=GracefulDiagnostics(standing=task.standing))
        if task.distance_m < s.arrival_m and task.turn_rad is not None:
            return Plan(BodyTwist(0.0, 0.0, rotation(task.turn_rad, self._law)), diagnostics=GracefulDiagnostics(rotating=True))
        return self._drive(task, belief)

    def snapshot(self) -> bytes:
        """Return nothing: it has no state."""
        return b""

    def restore(self, snapshot: bytes) -> None:
        """Nothing to take over."""

    def _drive(self, task: Task, belief: Belief) -> Plan:
        """Return the twist towards the farthest target that can be reached."""
        s, lattice = self._settings, belief.clearance.lattice
        targets, along = self._targets(task), arc_length(task.path)
        ending = task.left_m <= s.max_lookahead_m
        nearest = 0 if ending else int(np.searchsorted(along, s.min_lookahead_m))
        field = Field(belief.clearance.clearance_m, lattice.x_m, lattice.y_m, lattice.cell_m, task.required_m)
        reach_m = float(np.hypot(*(task.path - task.pose[:2]).T).max())
        way = np.empty((1 + math.ceil(3.0 * reach_m / lattice.cell_m), 3))
        aim = ending and s.prefer_final_rotation
        best, count, speed, turn = choose(task.pose, targets, aim, self._law, field, min(nearest, len(targets) - 1), way)
        if best < 0:
            return Plan(BodyTwist(), diagnostics=GracefulDiagnostics(standing="every target collides"))
        simulated = np.concatenate((task.pose[None, :2], way[:count, :2]))
        diagnostics = GracefulDiagnostics(float(along[best]), len(targets) - 1 - best, rotating=speed == 0.0)
        drawn = Drawing("target", targets[best : best + 1, :2].copy(), connected=False), Drawing("simulated", simulated)
        return Plan(BodyTwist(speed, 0.0, turn), path_in_odom=simulated, diagnostics=diagnostics, drawings=drawn)

    def _targets(self, task: Task) -> F64:
        """Return the path's points with the heading to the next one, shape (n, 3); the last has the goal's, if it is one."""
        steps = np.diff(task.path, axis=0)
        yaw = np.arctan2(steps[:, 1], steps[:, 0])
        last = yaw[-1]
        if task.turn_rad is not None and task.left_m <= self._settings.max_lookahead_m:
            last = task.pose[2] + task.turn_rad
        return np.column_stack((task.path, np.append(yaw, last)))
