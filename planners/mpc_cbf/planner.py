"""Model predictive control with discrete-time control barriers around tracks and boundary cells, for a unicycle.

Source: Zeng, Zhang, Sreenath, Safety-critical model predictive control with discrete-time control barrier function, ACC 2021.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, Belief
from planners import standing
from planners.mpc_cbf.kernels import barriers, fall, linearised, rollout
from planners.mpc_cbf.program import FAR, BarrierProgram, Costs, Solution, Subproblem
from planners.mpc_cbf.reference import ahead_of, reference
from planners.mpc_cbf.settings import BarrierMpcSettings
from planners.planner import Diagnostics, Drawing, Plan, PlannerSetup
from planners.router import Route
from planners.standing import Discs, StandingWorld, boundary_points, standing_world
from planners.static_field import movers


@dataclass(frozen=True, slots=True)
class BarrierMpcDiagnostics(Diagnostics):
    """What was predicted, and how hard it was."""

    barriers: int = 0  # that constrain
    solver_iterations: int = 0  # of all quadratic programs together
    solved: bool = True  # False: the last one had not come near its constraints, and the robot brakes
    worst_fall_m: float = 0.0  # by how much a barrier falls faster than it may, at the worst step; above 0: it was softened
    least_barrier_m: float = math.inf  # along the prediction: room beyond the margin
    enclosed: bool = False  # the robot's own cell is occupied


@dataclass(frozen=True, slots=True)
class _Prediction:
    """Inputs, the states they lead to, and the barriers along them."""

    inputs: F64  # (n, 2)
    states: F64  # (n + 1, 3)
    value: F64  # (n + 1, m)
    gradient: F64  # (n + 1, m, 2)


class BarrierMpc:
    """Follows the route with the inputs of a quadratic program, linearised about the last plan, that keeps its barriers."""

    Settings = BarrierMpcSettings
    default_shield: ClassVar[str] = "none"

    def __init__(self, settings: BarrierMpcSettings, setup: PlannerSetup) -> None:
        """Set the solver up.

        Raises:
            ConfigurationError: there is no base.
        """
        if setup.limits is None:
            raise ConfigurationError("planner.name 'mpc_cbf' drives a base, but the robot has none")
        s, cap = settings, setup.limits.velocity
        self._settings, self._setup, self._limits = settings, setup, setup.limits
        self._times_s = np.linspace(s.step_s, s.steps * s.step_s, s.steps)
        self._highest = np.array([min(s.max_speed_m_s, cap.vx), cap.wz])
        self._lowest = np.array([-min(s.reverse_m_s, cap.vx) if setup.limits.reverse else 0.0, -cap.wz])
        self._gamma = 1.0 - math.exp(-s.barrier_rate_per_s * s.step_s)
        self._program = BarrierProgram(s.steps, s.tracks + s.boundary_points, self._gamma, _costs(s), s.solver_iterations)
        self._reset()

    def warm_up(self) -> None:
        """Compile the kernels."""
        standing.warm_up()
        states = rollout(np.zeros(3), np.zeros((1, 2)), 0.1)
        linearised(states, np.zeros((1, 2)), 0.1)
        fall(barriers(states, np.ones((1, 2)), np.zeros((1, 2)), np.ones(1), 0.1)[0], 0.5)

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the first inputs of the plan; zero without a route, at its end, inside an obstacle and without a solution."""
        pose = belief.odom_from_base
        state, world = np.array([pose.x, pose.y, pose.yaw]), standing_world(belief)
        here_m = float(world.clearance_at(state[None, :2])[0])
        left_m = math.hypot(*(route.path_in_odom[-1] - state[:2])) if not route.empty else 0.0
        if here_m <= 0.0 or left_m < self._settings.arrival_m:
            self._reset()
            return Plan(BodyTwist(), diagnostics=BarrierMpcDiagnostics(enclosed=here_m <= 0.0))
        discs = self._discs(belief, state, world)
        prediction, iterations = self._iterate(state, belief.twist, route.path_in_odom, discs)
        solved = self._solution.solved
        diagnostics = BarrierMpcDiagnostics(
            len(discs), iterations, solved, max(float(fall(prediction.value, self._gamma).max(initial=0.0)), 0.0),
            float(prediction.value.min(initial=math.inf)),
        )  # fmt: skip
        path = prediction.states[:, :2]
        twist = BodyTwist(float(prediction.inputs[0, 0]), 0.0, float(prediction.inputs[0, 1])) if solved else BodyTwist()
        if not solved:
            self._reset()
        return Plan(twist, path_in_odom=path, diagnostics=diagnostics, drawings=self._drawings(prediction, discs))

    def snapshot(self) -> bytes:
        """Return the last plan's inputs and the solver's start."""
        return pack(inputs=self._inputs, primal=self._solution.primal, dual=self._solution.dual)

    def restore(self, snapshot: bytes) -> None:
        """Take over a plan."""
        state = unpack(snapshot)
        self._inputs = state["inputs"]
        self._solution = Solution(state["primal"], state["dual"], False, 0)

    def _reset(self) -> None:
        """Forget the last plan: begin from standing."""
        self._inputs = np.zeros((self._settings.steps, 2))
        self._solution = self._program.start()

    def _iterate(self, state: F64, twist: BodyTwist, path: F64, discs: Discs) -> tuple[_Prediction, int]:
        """Return what the quadratic programs, each linearised about the one before, come to, and the solver's iterations."""
        s = self._settings
        before = np.clip(np.array([twist.vx, twist.wz]), self._lowest, self._highest)
        rest = ahead_of(state[:2], path)
        aim, speed = reference(rest, float(self._highest[0]), 0.5 * self._limits.acceleration.vx, self._times_s)
        prediction, iterations = self._predict(state, self._shifted(), discs), 0
        for _ in range(s.iterations):
            problem = self._subproblem(prediction, before, aim, speed)
            self._solution = self._program.solve(problem, self._solution)
            inputs = np.clip(prediction.inputs + self._solution.of_inputs(s.steps), self._lowest, self._highest)
            prediction, iterations = self._predict(state, inputs, discs), iterations + self._solution.iterations
        self._inputs = prediction.inputs
        return prediction, iterations

    def _shifted(self) -> F64:
        """Return the last inputs, as much later as a period is long."""
        times = np.concatenate(([0.0], self._times_s[:-1])) + self._setup.period_s
        knots = self._times_s - self._settings.step_s
        return np.stack([np.interp(times, knots, self._inputs[:, i]) for i in range(2)], axis=1)

    def _predict(self, state: F64, inputs: F64, discs: Discs) -> _Prediction:
        step_s = self._settings.step_s
        states = rollout(state, inputs, step_s)
        value, gradient = barriers(states, discs.centre, discs.velocity, discs.radius_m, step_s)
        return _Prediction(inputs, states, value, gradient)

    def _subproblem(self, at: _Prediction, before: F64, aim: F64, speed: F64) -> Subproblem:
        """Return the program linearised about a prediction."""
        s, limits = self._settings, self._limits.acceleration
        error = at.states[1:] - aim
        error[:, 2] = (error[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
        input_error = at.inputs - np.stack((speed, np.zeros(s.steps)), axis=1)
        most, count = s.tracks + s.boundary_points, at.value.shape[1]
        gradient, missing = np.zeros((s.steps + 1, most, 2)), np.full((s.steps, most), -FAR)
        gradient[:, :count], missing[:, :count] = at.gradient, fall(at.value, self._gamma)
        change = s.step_s * np.array([limits.vx, limits.wz])
        slopes = linearised(at.states, at.inputs, s.step_s)
        return Subproblem(slopes, error, input_error, at.inputs, before, self._lowest, self._highest, change, gradient, missing)

    def _discs(self, belief: Belief, state: F64, world: StandingWorld) -> Discs:
        """Return what barriers are drawn around, widened by the robot and the margin: the nearest tracks and boundary cells."""
        s = self._settings
        widen_m = self._setup.robot_radius_m + s.margin_m
        tracks = Discs.of(movers(belief))
        nearest = np.argsort(np.hypot(*(tracks.centre - state[:2]).T) - tracks.radius_m, kind="stable")[: s.tracks]
        path = rollout(state, self._shifted(), s.step_s)[:, :2]
        points = boundary_points(world, path, s.boundary_range_m, s.boundary_spacing_m, s.boundary_points)
        return Discs(
            np.concatenate((tracks.centre[nearest], points)),
            np.concatenate((tracks.velocity[nearest], np.zeros((len(points), 2)))),
            np.concatenate((tracks.radius_m[nearest], np.zeros(len(points)))) + widen_m,
        )

    def _drawings(self, prediction: _Prediction, discs: Discs) -> tuple[Drawing, ...]:
        """Return the predicted states, and where the barriers' discs are then."""
        end_s = self._settings.steps * self._settings.step_s
        later = discs.centre + end_s * discs.velocity
        return (
            Drawing("prediction", prediction.states[:, :2], False),
            Drawing("barriers", discs.centre, False),
            Drawing("barriers at the horizon", later, False),
        )


def _costs(s: BarrierMpcSettings) -> Costs:
    """Return the weights of a program; the terminal one multiplies the state's."""
    state = np.tile([s.weight_position, s.weight_position, s.weight_heading], (s.steps, 1))
    state[-1] *= s.weight_terminal
    return Costs(state, np.array([s.weight_speed, s.weight_turn]), np.full(2, s.weight_change), s.weight_slack)
