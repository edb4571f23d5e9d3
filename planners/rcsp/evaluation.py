"""One decision's numbers: reward, tail risk and objective of every command."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.belief import F32, F64
from planners.planner import Diagnostics
from planners.prediction.chance import Chance
from planners.prediction.conjectures import ConjectureFamily
from planners.prediction.predictor import Futures, Occasion, Predictor
from planners.prediction.walls import Walls, keep_out
from planners.rcsp.clearance_kernels import clearances
from planners.rcsp.reacting_kernels import reacting_clearances
from planners.rcsp.risk_kernels import INVERSE_CLEARANCE, NEAR_MISS, VIOLATION, Risk, largest, mean_risks, tails
from planners.rcsp.settings import RcspSettings, RiskSettings
from planners.risk import objective_error, tail_count
from planners.velocity_lattice import Rollouts, path_of

KINDS = {"inverse_clearance": INVERSE_CLEARANCE, "violation": VIOLATION, "near_miss": NEAR_MISS}
_LEAST_SAFE_M = 1e-3  # risk is measured in shares of it
REWARD_RANGE = 2.0  # B_R: rewards are cut to [-1, 1]


@dataclass(frozen=True, slots=True)
class Evaluation:
    """What came of the scenarios, for every command."""

    objective: F64  # (commands,), J
    reward: F64  # (commands,), R
    risk: F64  # (commands,), the risk measure of G
    room_m: F64  # (commands,), mean clearance of the tail, up to where there is no risk
    free: NDArray[np.bool_]  # (commands,), whether fewer scenarios than make a tail touch anything
    clearance: F32  # (commands, scenarios)
    static_m: F32  # (commands,), to what stands still
    brakable: NDArray[np.bool_]  # (commands,)
    form: Risk
    futures: Futures
    tail: int  # scenarios in it
    static_safe_m: float  # clearance beyond which what stands still was no risk

    def best(self, effort: F64) -> tuple[int, bool]:
        """Return the command to ask for, and whether it is free: the best by objective, else, where none is, the least risky.

        Where the tail of every command touches somebody, tails do not differ by how likely that is, so it is the mean risk that
        decides.  Of commands that are as risky, the calmest is taken, by `effort`, shape (commands,): progress does not decide
        between collisions.
        """
        if self.free.any():
            return int(np.argmax(np.where(self.free, self.objective, -np.inf))), True
        risk = np.rint(1e6 * self.mean_risks(slice(None)))
        return int(np.argmin(np.where(risk == risk.min(), effort, np.inf))), False

    def mean_risks(self, commands: slice) -> F64:
        """Return the mean of G over all scenarios, shape (commands,)."""
        risks: F64 = mean_risks(
            self.clearance[commands], self.static_m[commands], self.brakable[commands], self.form, self.static_safe_m
        )
        return risks


class Evaluator:
    """Holds rollouts against sampled futures."""

    def __init__(self, settings: RcspSettings, predictor: Predictor, robot_radius_m: float, commands: int) -> None:
        """Take settings and predictor."""
        self._settings, self._predictor, self._radius_m, self._commands = settings, predictor, robot_radius_m, commands
        self._times_s: F64 = np.asarray(
            settings.lattice.latency_s + settings.step_s * np.arange(1, settings.steps + 1), np.float64
        )
        self._steps_s = np.diff(self._times_s, prepend=0.0)
        after_s = settings.rest_step_s * np.arange(1, settings.rest_steps + 1)
        self._all_times_s: F64 = np.concatenate((self._times_s, self._times_s[-1] + after_s))
        r = settings.risk
        self._risk = Risk(KINDS[r.kind], r.safe_m, r.collision, r.depth_m)
        self._bound = max(largest(self._risk, r.safe_m), largest(self._risk, r.static_safe_m))

    def evaluate(
        self, rolled: Rollouts, reward: F64, nominal: int, scenarios: int, chance: Chance, room_m: float, walls: Walls
    ) -> Evaluation:
        """Return the evaluation of all commands in `scenarios` futures, the same for every command.

        Args:
            rolled: where each command leads.
            reward: shape (commands,).
            nominal: the command of the motion of the robot that obstacles react to.
            scenarios: N.
            chance: what futures are drawn from.
            room_m: least clearance to what stands still on the way ahead.
            walls: what nobody goes through.
        """
        s, static_safe_m = self._settings, self.static_safe_m(room_m)
        futures, clearance = self._held_against(rolled, path_of(rolled, nominal), scenarios, chance, walls)
        tail = tail_of(s.risk, scenarios)
        risk, tail_room_m, free = tails(clearance, rolled.static_m, rolled.brakable, tail, self._risk, static_safe_m)
        objective = reward - s.risk.weight * risk
        return Evaluation(
            objective, reward, risk, tail_room_m, free, clearance, rolled.static_m, rolled.brakable, self._risk, futures, tail,
            static_safe_m,
        )  # fmt: skip

    def static_safe_m(self, room_m: float) -> float:
        """Return the clearance beyond which what stands still is no risk, on a way that has so little room.

        The way through a gap is as narrow as it is, however long one waits before it: only what comes nearer than the way itself
        leads is a risk.  A way through what stands says nothing.
        """
        s = self._settings
        return min(s.risk.static_safe_m, max(room_m, s.hold_m, _LEAST_SAFE_M)) if room_m > 0.0 else s.risk.static_safe_m

    def _held_against(self, rolled: Rollouts, robot: F64, scenarios: int, chance: Chance, walls: Walls) -> tuple[Futures, F32]:
        s, predictor = self._settings, self._predictor
        far_m = s.risk.safe_m
        stays = np.concatenate((robot, np.repeat(robot[-1:], s.rest_steps, axis=0)))
        occasion = Occasion(self._all_times_s, stays, scenarios)
        if s.reaction == "candidate" and isinstance(predictor, ConjectureFamily):
            futures, draws = predictor.sample_with_draws(occasion, chance)
            position, contact = self._held(futures, walls)
            at_rest = clearances(rolled.x[:, :0].copy(), rolled.y[:, :0].copy(), rolled.rest, position[s.steps :], contact, far_m)
            clearance = np.minimum(reacting_clearances(rolled.x, rolled.y, draws, self._steps_s, far_m), at_rest)
        else:
            futures = predictor.sample(occasion, chance)
            position, contact = self._held(futures, walls)
            clearance = clearances(rolled.x, rolled.y, rolled.rest, position, contact, far_m)
        return Futures(position[: s.steps], futures.radius_m, futures.conjecture), clearance

    def _held(self, futures: Futures, walls: Walls) -> tuple[F32, F32]:
        """Hold futures by walls; return them, and at which distance of the centres each obstacle touches, shape (obstacles,)."""
        keep_out(futures.position_in_odom, futures.radius_m, walls)
        return futures.position_in_odom, (futures.radius_m + self._radius_m).astype(np.float32)

    def bound(self, scenarios: int) -> float:
        """Return epsilon_N(delta) of proposition C.3."""
        s = self._settings.risk
        share = tail_of(s, scenarios) / scenarios
        return objective_error(scenarios, share, self._bound, REWARD_RANGE, s.weight, self._commands, s.delta)


def tail_of(settings: RiskSettings, scenarios: int) -> int:
    """Return how many scenarios count: all for the mean, one for the worst, else the tail."""
    if settings.measure == "cvar":
        return tail_count(scenarios, settings.tail_fraction)
    return scenarios if settings.measure == "mean" else 1


@dataclass(frozen=True, slots=True)
class RcspDiagnostics(Diagnostics):
    """How a decision came about."""

    stopped: str = ""  # why it asks to stand
    warning: str = ""  # what was wrong with what it was given
    scenarios: int = 0  # N
    budget_ms: float = 0.0  # time it was given; 0: no limit
    bound: float = 0.0  # epsilon_N(delta) of proposition C.3
    objective: float = 0.0  # J of the chosen command
    progress: float = 0.0  # R
    cvar: float = 0.0  # the risk measure
    mean_risk: float = 0.0
    tail_room_m: float = 0.0  # mean clearance of its tail
    free: int = 0  # commands whose tail touches nothing
    obstacles: int = 0
    commitment_s: float = -1.0  # until the fastest way on meets its tail, less what braking takes; negative: it does not
    weight_static: float = 0.0
    weight_slow: float = 0.0
    weight_constant: float = 0.0
    weight_fast: float = 0.0
    weight_yielding: float = 0.0
    weight_aggressive: float = 0.0
