"""The fixed safety filter over a finite lattice: CBF-style, discrete, over any planner.

Source: Han, Zhu, RCSP, section 4.4.  README.md beside this file says what differs and why.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BodyTwist, Command
from drivers.interface.samples import frozen_array
from estimators.belief import Belief
from planners import static_field
from planners.planner import Diagnostics, Drawing
from planners.prediction.walls import Walls
from planners.shield import Filtered, ReachableSet, ShieldSetup
from planners.shields.lattice_answer_kernels import Answer, times_of
from planners.shields.lattice_company import futures, with_resters
from planners.shields.lattice_kernels import Local, forecast
from planners.shields.lattice_resters import Resters
from planners.shields.lattice_settings import LatticeShieldSettings
from planners.static_field import movers, surroundings
from planners.velocity_lattice import VelocityLattice

F64 = NDArray[np.float64]

_NOMINAL_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)  # of the asked twist: on a base that can strafe the lattice holds none of them
_TIE = 1e-9


@dataclass(frozen=True, slots=True)
class LatticeShieldDiagnostics(Diagnostics):
    """How the command was filtered."""

    feasible: int  # of the candidates
    asked_feasible: bool
    clearance_m: float  # now, up to `far_m`
    least_clearance_m: float  # on the rollout of what is sent
    enclosed: bool = False  # an obstacle lies on the robot
    infeasible: bool = False  # no candidate is feasible: what is sent is the best of what is penalised


class LatticeShield:
    """Lattice filter: what was asked where a short rollout of it keeps clear, else the best candidate of a velocity lattice."""

    Settings = LatticeShieldSettings

    def __init__(self, settings: LatticeShieldSettings, setup: ShieldSetup) -> None:
        """Lay the lattice."""
        self._settings, self._radius_m = settings, setup.robot_radius_m
        self._twists, self._caps, acceleration = np.zeros((0, 3)), np.ones(3), np.ones(3)
        if setup.limits is not None:
            lattice, limits = VelocityLattice.of(settings.lattice, setup.limits), setup.limits
            speeds, turns = np.meshgrid(lattice.speed_m_s, lattice.turn_rad_s, indexing="ij")
            self._twists = np.stack((speeds.ravel(), np.zeros(len(lattice)), turns.ravel()), axis=1)
            self._caps = np.array([limits.velocity.vx, max(limits.velocity.vy, 1.0), limits.velocity.wz])
            acceleration = np.array([limits.acceleration.vx, limits.acceleration.vy, limits.acceleration.wz])
        s, base = settings, settings.lattice
        step_s, after_step_s = s.horizon_s / s.steps, s.after_s / s.after_steps
        self._answer = Answer(acceleration, base.latency_s, base.response_s, step_s, s.steps, after_step_s, s.after_steps)
        (self._times_s, self._looks), self._resters = times_of(self._answer), Resters(s.patience_s, s.steady_s)

    @property
    def kept_clear_m(self) -> float:
        """The robot's radius and c_hard: nearer to what stands no rollout is feasible [m]."""
        return self._radius_m + self._settings.hard_m

    def warm_up(self) -> None:
        """Compile the kernels; a belief's arrays are read-only, which is a type of its own."""
        label = frozen_array(np.zeros((3, 3), np.uint8))
        static_field.warm_up(label)
        for field in (np.ones((3, 3), np.float32), frozen_array(np.ones((3, 3), np.float32))):
            where, radius_m = futures((), (), self._times_s, Walls(field, 0.0, 0.0, 1.0))
            local = Local(field, 0.0, 0.0, 1.0, where[self._looks], radius_m, 0.1, 1.0)
            forecast(np.zeros(3), np.zeros(3), np.zeros(3), np.zeros((1, 3)), self._answer, local)

    def filter(self, command: Command, belief: Belief, reachable: ReachableSet) -> Filtered:
        """Return the command with its twist filtered into `reachable`; one that is not finite counts as a stop."""
        if command.base is None:
            return Filtered(command)
        asked = command.base if command.base.finite else BodyTwist()
        twists = self._candidates(asked)
        least, end, here = self._forecast(belief, twists, reachable)
        violation = self._violation(least, here)
        feasible = violation == 0.0
        chosen = self._choose(twists, least, end - (belief.odom_from_base.x, belief.odom_from_base.y), violation, here)
        twist = reachable.clip(BodyTwist(*twists[chosen].tolist()))
        said = LatticeShieldDiagnostics(
            int(feasible.sum()), bool(feasible[0]), here, float(least[chosen]), here < 0.0, not bool(feasible.any())
        )
        drawings = (Drawing("asked", end[:1], connected=False), Drawing("sent", end[[chosen]], connected=False))
        return Filtered(replace(command, base=twist), twist != reachable.clip(command.base), said, drawings)

    def snapshot(self) -> bytes:
        """Return the whole state: how everybody came."""
        return self._resters.snapshot()

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        self._resters.restore(snapshot)

    def _candidates(self, asked: BodyTwist) -> F64:
        """Return A_t, shape (n, 3), the asked twist first."""
        own = np.array([_NOMINAL_SHARES]).T * (asked.vx, asked.vy, asked.wz)
        return np.concatenate((own, self._twists))

    def _forecast(self, belief: Belief, twists: F64, reachable: ReachableSet) -> tuple[F64, F64, float]:
        s, pose, now, answer = self._settings, belief.odom_from_base, belief.twist, self._answer
        resting = self._resters.observe(belief)
        moving = with_resters(movers(belief), resting)
        fastest = max(math.hypot(now.vx, now.vy), math.sqrt(float((twists[:, :2] ** 2).sum(axis=1).max())))
        reach_m = fastest * self._times_s[-1]
        near = surroundings(belief, s.track_margin_m, reach_m, s.far_m + self._radius_m, moving)
        at = near.lattice
        where, radius_m = futures(moving, resting, self._times_s, Walls(near.clearance_m, at.x_m, at.y_m, at.cell_m))
        local = Local(
            near.clearance_m, at.x_m, at.y_m, at.cell_m, where[self._looks], radius_m + self._radius_m, self._radius_m, s.far_m
        )
        told: tuple[F64, F64, float] = forecast(
            np.array([pose.x, pose.y, pose.yaw]), np.array([now.vx, now.vy, now.wz]), _middle(reachable), twists, answer, local
        )
        return told

    def _violation(self, least_m: F64, here_m: float) -> F64:
        """Return by how much each rollout misses c_hard, or the share 1 - kappa of the margin that is there now, (n,) [m]."""
        hard_m, gain = self._settings.hard_m, self._settings.gain
        kept_m = hard_m + (1.0 - gain) * max(0.0, here_m - hard_m)
        return np.asarray(np.maximum(0.0, kept_m - least_m))

    def _choose(self, twists: F64, least_m: F64, moved: F64, violation_m: F64, here_m: float) -> int:
        """Return the candidate to send: the asked one where it is feasible, else the best, what is infeasible being penalised."""
        if violation_m[0] == 0.0:
            return 0
        s = self._settings
        if here_m < 0.0:  # an obstacle lies on the robot: nothing is worth pressing on for; of equals, the slowest
            speed = np.abs(twists / self._caps).sum(axis=1)
            return int(np.lexsort((speed, np.round(violation_m / _TIE)))[0])
        away = np.abs((twists - twists[0]) / self._caps).sum(axis=1)
        length_m = math.hypot(*moved[0])
        towards = moved[0] / length_m if length_m > _TIE else np.zeros(2)
        worth = s.weight_progress * (moved @ towards) + s.weight_clearance * least_m - s.weight_closeness * away
        return int(np.argmax(worth - s.weight_violation * violation_m))


def _middle(reachable: ReachableSet) -> F64:
    """Return the middle of what can be sent now, shape (3,): what was sent last goes on to there."""
    low, high = reachable.lowest, reachable.highest
    return 0.5 * np.array([low.vx + high.vx, low.vy + high.vy, low.wz + high.wz])
