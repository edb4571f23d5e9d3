"""Optimal reciprocal collision avoidance among tracks and boundary cells, for holonomic and differential bases.

Sources: van den Berg, Guy, Lin, Manocha, Reciprocal n-body collision avoidance, ISRR 2009; Alonso-Mora et al., Optimal
reciprocal collision avoidance for multiple non-holonomic robots, DARS 2010.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from drivers.interface.samples import frozen_array
from estimators.belief import Belief
from planners import standing
from planners.dwa.kernels import Surroundings, visible_along
from planners.orca.half_plane_kernels import agent_half_planes, standing_half_planes
from planners.orca.motion import motion_of
from planners.orca.program_kernels import choose_velocity
from planners.orca.settings import ReciprocalAvoidanceSettings
from planners.planner import Diagnostics, Drawing, Plan, PlannerSetup
from planners.polyline import resample
from planners.router import Route
from planners.shields.plane_qp import feasible_polygon
from planners.standing import Discs, StandingWorld, boundary_points, standing_world
from planners.static_field import movers

F64 = NDArray[np.float64]

_DRAWN_AGENTS = 6
_CARROT_STEP_M = 0.1  # between points of the route that may be aimed at
_NO_LABEL = frozen_array(np.zeros((1, 1), np.uint8))  # of the ground that is looked across; what was never seen hides nothing


@dataclass(frozen=True, slots=True)
class ReciprocalAvoidanceDiagnostics(Diagnostics):
    """What the velocity was chosen among."""

    agents: int = 0
    boundary_points: int = 0
    tracking_error_m: float = 0.0  # that the base may make
    violation_m_s: float = 0.0  # granted to every agent's half-plane; 0 where all could be kept
    least_gap_m: float = math.inf  # from the robot to the nearest agent or cell; negative when it touches
    enclosed: bool = False  # the robot's own cell is occupied


@dataclass(frozen=True, slots=True)
class _Choice:
    """The half-planes in the body frame, the hard ones first, and what was chosen in them."""

    normals: F64  # (n, 2)
    bounds: F64  # (n,)
    hard: int
    velocity: F64  # (2,)
    violation_m_s: float


class ReciprocalAvoidance:
    """The velocity nearest to the route's that no track and no boundary forbids, and the arc on which the base follows it."""

    Settings = ReciprocalAvoidanceSettings
    default_shield: ClassVar[str] = "none"

    def __init__(self, settings: ReciprocalAvoidanceSettings, setup: PlannerSetup) -> None:
        """Take the limits.

        Raises:
            ConfigurationError: there is no base.
        """
        if setup.limits is None:
            raise ConfigurationError("planner.name 'orca' drives a base, but the robot has none")
        self._settings, self._setup, self._limits = settings, setup, setup.limits
        self._motion = motion_of(setup.limits, settings.max_speed_m_s, settings.turn_s)

    def warm_up(self) -> None:
        """Compile the kernels."""
        standing.warm_up()
        field = frozen_array(np.ones((3, 3), np.float32))
        visible_along(np.zeros((2, 2)), 1.0, Surroundings(field, _NO_LABEL, 0.0, 0.0, 1.0, 0.1, -1.0))
        offset = np.array([[1.0, 0.0]])
        agent_half_planes(offset, np.zeros((1, 2)), np.ones(1), np.zeros(2), 1.0, 1.0, 0.1)
        normals, bounds = standing_half_planes(offset, 0.5, 1.0)
        choose_velocity(normals, bounds, 1, np.zeros(2))
        feasible_polygon(normals, bounds, 0.0, np.zeros(2), np.ones(2))

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the twist; zero without a route, at its end, and inside an obstacle."""
        pose = belief.odom_from_base
        here, agents, world = np.array([[pose.x, pose.y]]), Discs.of(movers(belief)), standing_world(belief)
        here_m = float(world.clearance_at(here)[0])
        gap_m = min(here_m, agents.gap_m(pose.x, pose.y)) - self._setup.robot_radius_m
        left_m = math.hypot(*(route.path_in_odom[-1] - here[0])) if not route.empty else 0.0
        if here_m <= 0.0 or left_m < self._settings.arrival_m:
            return Plan(BodyTwist(), diagnostics=ReciprocalAvoidanceDiagnostics(enclosed=here_m <= 0.0, least_gap_m=gap_m))
        s = self._settings
        error_m = min(max(gap_m - s.margin_m, s.least_tracking_error_m), s.tracking_error_m)
        points = boundary_points(world, here, s.boundary_range_m, s.boundary_spacing_m, s.boundary_points)
        wanted = self._motion.preferred(self._wanted(pose, route, world, left_m), error_m)
        choice = self._choose(belief, agents, points, wanted, error_m)
        diagnostics = ReciprocalAvoidanceDiagnostics(len(agents), len(points), error_m, choice.violation_m_s, gap_m)
        ahead = pose.apply(np.array([[0.0, 0.0], choice.velocity * s.horizon_s]))
        drawings = _drawings(pose, choice, len(agents), s.max_speed_m_s)
        return Plan(self._motion.twist(choice.velocity, wanted), path_in_odom=ahead, diagnostics=diagnostics, drawings=drawings)

    def snapshot(self) -> bytes:
        """Return nothing: it has no state."""
        return b""

    def restore(self, snapshot: bytes) -> None:
        """Nothing to take over."""

    def _wanted(self, pose: SE2, route: Route, world: StandingWorld, left_m: float) -> F64:
        """Return the velocity, shape (2,), in the body frame, towards the farthest point of the route that can be seen."""
        s, lattice, here = self._settings, world.lattice, np.array([[pose.x, pose.y]])
        nearest = int(np.argmin(np.hypot(*(route.path_in_odom - here).T)))
        rest = route.path_in_odom[min(nearest + 1, len(route.path_in_odom) - 1) :]
        path = resample(np.concatenate((here, rest)), _CARROT_STEP_M)
        room_m = min(self._setup.robot_radius_m + s.margin_m, float(world.clearance_at(here)[0]))
        ground = Surroundings(world.clearance_m, _NO_LABEL, lattice.x_m, lattice.y_m, lattice.cell_m, room_m, -1.0)
        carrot = pose.inverse().apply(path[visible_along(path, s.look_ahead_m, ground)])
        speed = min(s.max_speed_m_s, math.sqrt(self._limits.acceleration.vx * left_m))  # half the base's deceleration
        return np.asarray(carrot * (speed / max(math.hypot(*carrot), 1e-9)))

    def _choose(self, belief: Belief, agents: Discs, points: F64, wanted: F64, error_m: float) -> _Choice:
        """Return the velocity nearest to the wanted one, and among what."""
        s, pose = self._settings, belief.odom_from_base
        radius_m = self._setup.robot_radius_m + s.margin_m + error_m
        to_body, turn = pose.inverse(), SE2(0.0, 0.0, -pose.yaw)
        own = np.array([belief.twist.vx, belief.twist.vy])
        kept = (
            self._motion.permitted(error_m),
            standing_half_planes(to_body.apply(points), radius_m, s.standing_horizon_s),
            agent_half_planes(
                to_body.apply(agents.centre), turn.apply(agents.velocity), agents.radius_m + radius_m, own,
                s.responsibility, s.horizon_s, self._setup.period_s,
            ),
        )  # fmt: skip
        normals, bounds = np.concatenate([n for n, _ in kept]), np.concatenate([b for _, b in kept])
        hard = len(bounds) - len(agents)
        velocity, violation = choose_velocity(normals, bounds, hard, wanted)
        return _Choice(normals, bounds, hard, velocity, violation)


def _drawings(pose: SE2, choice: _Choice, agents: int, reach_m_s: float) -> tuple[Drawing, ...]:
    """Return the polygon of permitted velocities and the edges of the agents' half-planes: where the robot were after 1 s."""
    box = np.full(2, reach_m_s)
    polygon = feasible_polygon(choice.normals, choice.bounds, choice.violation_m_s + 1e-6, -box, box)
    drawn = [Drawing("permitted velocities", pose.apply(np.concatenate((polygon, polygon[:1]))))] if len(polygon) else []
    for i in range(min(agents, _DRAWN_AGENTS)):
        normal, bound = choice.normals[choice.hard + i], choice.bounds[choice.hard + i]
        foot = choice.velocity + (bound - normal @ choice.velocity) * normal
        along = 0.5 * np.array([-normal[1], normal[0]])
        drawn.append(Drawing(f"half-plane {i}", pose.apply(np.array([foot - along, foot + along]))))
    return tuple(drawn)
