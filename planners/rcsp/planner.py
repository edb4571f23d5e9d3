"""Risk-sensitive conjectural scenario planning: velocity commands by the tail of what obstacles may plausibly do.

Source: Han, Zhu, RCSP: Risk-Sensitive Conjectural Scenario Planning for Safe Dynamic Robot Navigation.  README.md beside this
file says what differs and why.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, Belief
from planners.planner import Plan, PlannerSetup
from planners.polyline import beginning
from planners.prediction.chance import Chance
from planners.prediction.conjectures import ConjectureFamily
from planners.prediction.constant_velocity import ConstantVelocityPredictor
from planners.prediction.predictor import Predictor
from planners.prediction.random_walk import RandomWalkPredictor
from planners.prediction.walls import Walls
from planners.rcsp.budget import affordable
from planners.rcsp.clearance_kernels import least_gap
from planners.rcsp.drawing import commitment_step, drawn
from planners.rcsp.evaluation import Evaluation, Evaluator, RcspDiagnostics
from planners.rcsp.progress_kernels import way_made
from planners.rcsp.rehearsal import rehearse
from planners.rcsp.settings import RcspSettings
from planners.router import Route
from planners.static_field import movers, surroundings
from planners.velocity_lattice import Drive, Ground, Rollouts, VelocityLattice, after_latency, least_room, path_of, roll_out

_SPACING_M = 0.12  # of the points of the route that progress is measured along
_FIELD_SPARE_M = 0.15  # what the clearance is known beyond where it matters, so that it need not be looked up at every step
_ROUTE_SPARE_M = 1.0  # how much farther along than a rollout reaches


class Rcsp:
    """RCSP: of a lattice of velocities, the best by progress less the CVaR of risk over sampled futures of the obstacles."""

    Settings = RcspSettings
    default_shield: ClassVar[str] = "lattice"

    def __init__(self, settings: RcspSettings, setup: PlannerSetup) -> None:
        """Set everything up.

        Raises:
            ConfigurationError: there is no base.
        """
        if setup.limits is None:
            raise ConfigurationError("planner.name 'rcsp' drives a base, but the robot has none")
        self._settings, self._setup = settings, setup
        self._lattice = VelocityLattice.of(settings.lattice, setup.limits)
        self._drive = Drive.of(settings.lattice, setup.limits)
        self._predictor = _predictor(settings, setup.robot_radius_m)
        self._evaluator = Evaluator(settings, self._predictor, setup.robot_radius_m, len(self._lattice))
        self._chance = Chance(setup.seed, "rcsp")
        backwards = np.maximum(-self._lattice.speed_m_s, 0.0) / self._lattice.speed_m_s[-1]
        self._reverse_cost = settings.reward.reverse * np.repeat(backwards, len(self._lattice.turn_rad_s))  # (commands,)
        self._reach_m = float(self._lattice.speed_m_s[-1]) * settings.step_s * settings.steps  # of full speed
        self._looks = np.array(_judged_at(settings.steps))
        self._standing = self._lattice.index_of_rest
        self._effort = self._lattice.change_from(self._standing)
        self._last = self._standing  # the command asked for last

    def warm_up(self) -> None:
        """Compile every kernel, on a scene of its own."""
        for reaction in ("nominal", self._settings.reaction):
            rehearse(type(self)(self._settings.model_copy(update={"reaction": reaction}), self._setup))

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the command with the best objective over all the scenarios of the settings."""
        return self._planned(belief, route, None)

    def plan_within(self, belief: Belief, route: Route, budget_ns: int) -> Plan:
        """Return the same over as many scenarios as there is time for."""
        return self._planned(belief, route, budget_ns)

    def _planned(self, belief: Belief, route: Route, budget_ns: int | None) -> Plan:
        belief = replace(belief, tracks=movers(belief))
        self._predictor.observe(belief)
        s, obstacles = self._settings, len(self._predictor.seen)
        distances = len(self._lattice) * (s.steps + s.rest_steps)
        reacting = self._settings.reaction == "candidate"
        scenarios = affordable(self._settings.budget, budget_ns, distances * obstacles, reacting=reacting)
        reason = self._refusal(belief, route) or ("there is no time for any scenario" if scenarios == 0 else "")
        if reason:
            self._last = self._standing
            said = RcspDiagnostics(stopped=reason, budget_ms=(budget_ns or 0) / 1e6, obstacles=obstacles)
            return Plan(BodyTwist(), diagnostics=said)
        path, along = _staying(belief) if route.empty else self._ahead(route)
        around = self._ground(belief)
        rolled = self._rolled_out(belief, around)
        room_m = least_room(path[1 : np.searchsorted(along, self._reach_m, side="right")], around)
        reward = self._reward(belief, path, along, rolled)
        chance = Chance(self._setup.seed, "rcsp", belief.tick) if self._settings.fresh_draws else self._chance
        walls = Walls(around.clearance, around.corner_x, around.corner_y, around.cell_m)
        nominal = self._lattice.nearest(belief.twist)
        told = self._evaluator.evaluate(rolled, reward, nominal, scenarios, chance, room_m, walls)
        self._last, free = told.best(self._effort)
        return self._plan(belief, rolled, told, free, budget_ns)

    def _refusal(self, belief: Belief, route: Route) -> str:
        """Return why there is nothing to do, or nothing."""
        pose = belief.odom_from_base
        makes_way = route.blocked and self._settings.blocked == "make_way"
        if route.empty and not makes_way:
            return "the way is blocked" if route.blocked else "no goal"
        if not (belief.twist.finite and math.isfinite(pose.x) and math.isfinite(pose.y) and math.isfinite(pose.yaw)):
            return "the pose or the twist is not finite"
        if route.empty:
            return ""
        end_x, end_y = route.path_in_odom[-1].tolist()
        if math.hypot(end_x - pose.x, end_y - pose.y) < self._settings.arrival_m:
            return "arrived"
        return ""

    def _ahead(self, route: Route) -> tuple[F64, F64]:
        """Return the route as far as rollouts reach, shape (m, 2), and the distance along it of its points, shape (m,)."""
        ahead: tuple[F64, F64] = beginning(route.path_in_odom, self._reach_m + _ROUTE_SPARE_M, _SPACING_M)
        return ahead

    def _ground(self, belief: Belief) -> Ground:
        """Return what stands still, as far as it matters to any command."""
        s, radius_m = self._settings, self._setup.robot_radius_m
        fastest = max(abs(belief.twist.vx), *np.abs(self._lattice.speed_m_s[[0, -1]]).tolist())
        far_m = max(s.risk.safe_m, s.risk.static_safe_m, s.hold_m)
        reach_m = fastest * (s.lattice.latency_s + s.step_s * s.steps)
        near = surroundings(belief, s.track_margin_m, reach_m, far_m + radius_m + _FIELD_SPARE_M)
        return Ground(
            near.clearance_m, near.label, near.lattice.x_m, near.lattice.y_m, near.lattice.cell_m,
            radius_m, s.hold_m, s.body_m if s.stop_before_unknown else -1.0, far_m,
        )  # fmt: skip

    def _rolled_out(self, belief: Belief, around: Ground) -> Rollouts:
        """Return where each command leads from when it takes hold."""
        s, pose, last = self._settings, belief.odom_from_base, self._lattice.twist(self._last)
        start, now = after_latency(
            np.array([pose.x, pose.y, pose.yaw]), np.array([belief.twist.vx, belief.twist.wz]),
            np.array([last.vx, last.wz]), self._drive,
        )  # fmt: skip
        speeds, turns = self._lattice.speed_m_s, self._lattice.turn_rad_s
        rolled: Rollouts = roll_out(start, now, speeds, turns, self._drive, s.step_s, s.steps, around)
        return rolled

    def _reward(self, belief: Belief, path: F64, along: F64, rolled: Rollouts) -> F64:
        """Return R of every command, shape (commands,): progress along the route over what full speed makes, less change."""
        r = self._settings.reward
        pose = belief.odom_from_base
        made_m = way_made(
            np.array([pose.x, pose.y, pose.yaw]), rolled.x, rolled.y, rolled.yaw, self._looks, path, along,
            r.lateral, r.heading_m_per_rad, r.look_ahead_m,
        )  # fmt: skip
        cost = self._reverse_cost + r.change * self._lattice.change_from(self._last)
        return np.asarray(np.minimum(np.maximum(made_m / self._reach_m - cost, -1.0), 1.0))

    def _plan(self, belief: Belief, rolled: Rollouts, told: Evaluation, free: bool, budget_ns: int | None) -> Plan:
        chosen = self._last
        position = told.futures.position_in_odom
        contact = (told.futures.radius_m + self._setup.robot_radius_m).astype(np.float32)
        keenest = int(np.argmax(told.reward))
        commitment = commitment_step(rolled, keenest, position, contact, told.tail)
        brake_s = max(0.0, belief.twist.vx) / self._drive.acceleration
        said = RcspDiagnostics(
            stopped="" if free else "every candidate is infeasible",
            warning=self._warning(belief),
            scenarios=position.shape[3],
            budget_ms=(budget_ns or 0) / 1e6,
            bound=self._evaluator.bound(position.shape[3]),
            objective=float(told.objective[chosen]),
            progress=float(told.reward[chosen]),
            cvar=float(told.risk[chosen]),
            mean_risk=float(told.mean_risks(slice(chosen, chosen + 1))[0]),
            tail_room_m=float(told.room_m[chosen]),
            free=int(told.free.sum()),
            obstacles=position.shape[1],
            commitment_s=max(0.0, (commitment + 1) * self._settings.step_s - brake_s) if commitment >= 0 else -1.0,
            **{
                f"weight_{name}": weight
                for name, weight in zip(self._predictor.conjectures, self._predictor.weights.tolist(), strict=True)
                if name != "random_walk"
            },
        )
        twist = self._lattice.twist(chosen)
        latency_ns = round(self._settings.lattice.latency_s * 1e9)
        return Plan(
            twist,
            path_in_odom=path_of(rolled, chosen),
            diagnostics=said,
            latency_ns=latency_ns,
            drawings=drawn(rolled, told, self._predictor.conjectures, keenest, commitment),
        )

    def _warning(self, belief: Belief) -> str:
        """Return what is wrong with the tracks, or nothing."""
        seen, pose = self._predictor.seen, belief.odom_from_base
        if seen.left_out:
            return f"{seen.left_out} tracks are not finite and were left out"
        if len(seen) == 0:
            return ""
        if least_gap(seen.state, seen.radius_m + self._setup.robot_radius_m, pose.x, pose.y) < 0.0:
            return "an obstacle lies on the robot"
        if seen.spread[:, 0].max() > self._settings.prediction.sigma_cap_m**2:
            return "a track is too uncertain to say where its obstacle is"
        return ""

    def snapshot(self) -> bytes:
        """Return the whole state."""
        return pack(last=self._last, predictor=np.frombuffer(self._predictor.snapshot(), np.uint8))

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        self._last = int(state["last"])
        self._predictor.restore(state["predictor"].tobytes())


def _staying(belief: Belief) -> tuple[F64, F64]:
    """Return the way of who has none and stays where he is, as `Rcsp._ahead` would: away from there is no progress."""
    pose = belief.odom_from_base
    return np.array([[pose.x, pose.y]] * 2), np.zeros(2)


def _judged_at(steps: int) -> tuple[int, ...]:
    """Return the steps at which progress is looked at; the best counts, so that who drives through the goal is not late there.

    >>> _judged_at(25)
    (7, 15, 24)
    """
    return steps // 3 - 1, 2 * steps // 3 - 1, steps - 1


def _predictor(settings: RcspSettings, robot_radius_m: float) -> Predictor:
    if settings.predictor == "conjectures":
        return ConjectureFamily(settings.prediction, robot_radius_m)
    return (
        ConstantVelocityPredictor()
        if settings.predictor == "constant_velocity"
        else RandomWalkPredictor(settings.diffusion_m_rt_s)
    )
