"""The dynamic window approach, for omnidirectional and differential bases.

Source: Fox, Burgard, Thrun, The dynamic window approach to collision avoidance, IEEE RAM 1997.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.samples import frozen_array
from estimators.belief import Belief, Lattice
from estimators.field_query import sample
from planners.dwa.kernels import Objective, Surroundings, advance, choose, visible_along
from planners.dwa.recovery import LookAround
from planners.dwa.settings import DynamicWindowSettings
from planners.dwa.window import dynamic_window
from planners.planner import Diagnostics, Plan, PlannerSetup
from planners.router import Route

F64 = NDArray[np.float64]

_SOONEST_S = 0.3  # progress is judged no sooner than this


@dataclass(frozen=True, slots=True)
class DynamicWindowDiagnostics(Diagnostics):
    """What was tried and what came of it."""

    samples: int = 0
    admissible: int = 0  # of the samples
    worth: float = 0.0  # of the chosen one
    free_m: float = 0.0  # along its arc; infinite when it turns on the spot
    braking: bool = False  # no sample was admissible
    looking_around: bool = False  # it stood too long and turns to see more
    enclosed: bool = False  # the robot's own cell is occupied


class DynamicWindow:
    """Dynamic window approach: of the velocities that can be reached soon, the best one that it can stop from in time."""

    Settings = DynamicWindowSettings
    default_shield: ClassVar[str] = "none"

    def __init__(self, settings: DynamicWindowSettings, setup: PlannerSetup) -> None:
        """Take the limits.

        Raises:
            ConfigurationError: there is no base.
        """
        if setup.limits is None:
            raise ConfigurationError("planner.name 'dwa' drives a base, but the robot has none")
        self._settings, self._setup, self._limits = settings, setup, setup.limits
        s = settings
        self._weights = np.array(
            [s.weight_progress, s.weight_facing, s.weight_clearance, s.weight_speed, s.weight_blind, s.weight_change]
        )
        self._recovery = LookAround(s.stall_s, min(s.look_around_rad_s, setup.limits.velocity.wz), setup.period_s)

    def warm_up(self) -> None:
        """Compile the kernels, on an empty field; its arrays are read-only as a belief's are, which is a type of its own."""
        field, label = frozen_array(np.ones((3, 3), np.float32)), frozen_array(np.zeros((3, 3), np.uint8))
        sample(field, Lattice(0.0, 0.0, 1.0, 3, 3), np.zeros((1, 2)))
        around = Surroundings(field, label, 0.0, 0.0, 1.0, 0.1, 0.1)
        goal = Objective(np.ones(2), 1.0, 0.5, 1.0, 1.0, 1.0, self._weights)
        choose(np.zeros(3), np.zeros(3), np.ones((1, 3)), np.ones(2), 0.1, 1.0, 0.1, 2, around, goal)
        visible_along(np.zeros((2, 2)), 1.0, around)
        advance(np.zeros(3), np.zeros(3), 1.0)

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the best admissible velocity; zero without a route, at its end, and inside an obstacle."""
        pose = np.array([belief.odom_from_base.x, belief.odom_from_base.y, belief.odom_from_base.yaw])
        here_m = float(sample(belief.clearance.clearance_m, belief.clearance.lattice, pose[None, :2])[0])
        left_m = math.hypot(*(route.path_in_odom[-1] - pose[:2])) if not route.empty else 0.0
        if here_m <= 0.0 or left_m < self._settings.arrival_m:
            self._recovery.reset()
            return Plan(BodyTwist(), diagnostics=DynamicWindowDiagnostics(enclosed=here_m <= 0.0))
        around = self._surroundings(belief, here_m)
        goal = self._objective(pose, route, around, left_m)
        twist, diagnostics = self._decide(belief, pose, around, goal)
        return Plan(twist, path_in_odom=self._arc(pose, twist), diagnostics=diagnostics)

    def snapshot(self) -> bytes:
        """Return the state of the recovery; all else follows from the belief."""
        return self._recovery.snapshot()

    def restore(self, snapshot: bytes) -> None:
        """Take over the state of the recovery."""
        self._recovery.restore(snapshot)

    def _surroundings(self, belief: Belief, here_m: float) -> Surroundings:
        """Return what arcs are laid through.

        A robot that stands nearer than the margin may still go where it is no narrower than here.
        """
        lattice, radius_m = belief.grid.lattice, self._setup.robot_radius_m
        required_m = min(radius_m + self._settings.margin_m, here_m)
        body_m = self._settings.body_m if self._settings.stop_before_unknown else -1.0
        field, label = belief.clearance.clearance_m, belief.grid.label
        return Surroundings(field, label, lattice.x_m, lattice.y_m, lattice.cell_m, required_m, body_m)

    def _objective(self, pose: F64, route: Route, around: Surroundings, left_m: float) -> Objective:
        """Return the objective; on the way, progress is judged when the carrot could be reached, so that it is not dawdled at."""
        s = self._settings
        nearest = int(np.argmin(np.hypot(*(route.path_in_odom - pose[:2]).T)))  # the route may be a few ticks old
        path = np.concatenate((pose[None, :2], route.path_in_odom[min(nearest + 1, len(route.path_in_odom) - 1) :]))
        ahead = visible_along(path, s.look_ahead_m, around)
        carrot = path[ahead]
        progress_s = s.horizon_s
        if ahead < len(path) - 1:
            progress_s = min(max(math.hypot(*(carrot - pose[:2])) / s.max_speed_m_s, _SOONEST_S), s.horizon_s)
        slowing = min(1.0, left_m / (s.max_speed_m_s * s.horizon_s))
        return Objective(carrot, progress_s, s.facing_s, s.comfort_m, s.max_speed_m_s, slowing, self._weights)

    def _decide(
        self, belief: Belief, pose: F64, around: Surroundings, goal: Objective
    ) -> tuple[BodyTwist, DynamicWindowDiagnostics]:
        """Return the twist, zero to brake when no sample is admissible."""
        s, now, stop = self._settings, belief.twist, self._limits.stop_deceleration
        counts = (s.samples_vx, s.samples_vy, s.samples_wz)
        samples = dynamic_window(now, self._limits, max(s.window_s, self._setup.period_s), counts, s.max_speed_m_s)
        brake = np.array([stop.vx, stop.vy if self._limits.holonomic else stop.vx])
        reaction_s = max(s.reaction_time_s, self._setup.period_s)
        best, admissible, value, free_m = choose(
            pose, np.array([now.vx, now.vy, now.wz]), samples, brake, reaction_s, s.horizon_s,
            s.body_m + s.max_speed_m_s * s.reaction_time_s, s.steps, around, goal,
        )  # fmt: skip
        if best < 0:
            return BodyTwist(), DynamicWindowDiagnostics(len(samples), braking=True)
        bearing_rad = math.atan2(goal.carrot[1] - pose[1], goal.carrot[0] - pose[0]) - pose[2]
        twist = self._recovery.amend(BodyTwist(*samples[best].tolist()), belief, bearing_rad)
        looking = self._recovery.active
        return twist, DynamicWindowDiagnostics(len(samples), admissible, value, free_m, looking_around=looking)

    def _arc(self, pose: F64, twist: BodyTwist) -> F64:
        """Return the arc of the chosen twist over the horizon, shape (steps + 1, 2)."""
        times = np.linspace(0.0, self._settings.horizon_s, self._settings.steps + 1)
        velocity = np.array([twist.vx, twist.vy, twist.wz])
        return np.array([advance(pose, velocity, float(t))[:2] for t in times])
