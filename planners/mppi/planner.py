"""Model predictive path integral control, for differential and omnidirectional bases.

Source: Williams et al., Information-theoretic model predictive control: theory and applications to autonomous driving,
IEEE T-RO 2018, and nav2_mppi_controller.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BodyTwist
from drivers.interface.samples import frozen_array
from estimators.belief import Belief, Lattice
from estimators.field_query import sample
from planners.mppi.critic_kernels import Costmap, collision_free
from planners.mppi.optimizer import Optimizer
from planners.mppi.scoring import Scored, Scorer
from planners.mppi.settings import MppiSettings
from planners.path_following import ARRIVED, Task, limits_of, task_of
from planners.planner import Diagnostics, Drawing, Plan, PlannerSetup
from planners.router import Route

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class MppiDiagnostics(Diagnostics):
    """What was sampled and what came of it."""

    free: int = 0  # trajectories that do not collide
    effective_samples: float = 0.0  # how many trajectories the average really rests on
    lowest_cost: float = 0.0
    furthest_m: float = 0.0  # along the path, that any trajectory reaches
    resets: int = 0  # within this decision
    standing: str = ""  # why it stands, if it does


class Mppi:
    """Model predictive path integral: samples control sequences and averages them by what critics charge their trajectories."""

    Settings = MppiSettings
    default_shield: ClassVar[str] = "none"

    def __init__(self, settings: MppiSettings, setup: PlannerSetup) -> None:
        """Take the limits and draw the noise.

        Raises:
            ConfigurationError: there is no base.
        """
        self._settings, self._required_m = settings, setup.robot_radius_m + settings.margin_m
        self._optimizer = Optimizer(settings, limits_of(setup, "mppi"), setup.period_s, setup.seed)
        self._scorer = Scorer(settings)

    def warm_up(self) -> None:
        """Compile the kernels; a belief's arrays are read-only, which is a type of its own."""
        field = frozen_array(np.ones((3, 3), np.float32))
        sample(field, Lattice(0.0, 0.0, 1.0, 3, 3), np.zeros((1, 2)))
        self._optimizer.warm_up()
        self._scorer.warm_up(self._optimizer, field)

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the first velocity of the sequence averaged now; zero where all collides, and where nothing is to follow."""
        s = self._settings
        task = task_of(belief, route, self._required_m, s.arrival_m, s.path_length_m, s.path_spacing_m)
        turned = task.turn_rad is not None and abs(task.turn_rad) < s.arrival_angle_rad
        standing = task.standing or (ARRIVED if task.distance_m < s.arrival_m and turned else "")
        if standing:
            self._optimizer.reset()
            return Plan(BodyTwist(), diagnostics=MppiDiagnostics(standing=standing))
        return self._optimize(task, belief)

    def snapshot(self) -> bytes:
        """Return the optimizer's state; all else follows from the belief."""
        return self._optimizer.snapshot()

    def restore(self, snapshot: bytes) -> None:
        """Take over the optimizer's state."""
        self._optimizer.restore(snapshot)

    def _optimize(self, task: Task, belief: Belief) -> Plan:
        """Sample and average; with nothing that does not collide, once more from rest, and then stand."""
        optimizer, around = self._optimizer, self._scorer.costmap(belief, task)
        optimizer.start_from(belief.twist)
        optimizer.redraw()
        for resets in range(self._settings.retry_attempt_limit + 1):
            if resets:
                optimizer.reset()
                optimizer.draw()
            scored, effective = self._iterate(task, around)
            path = optimizer.trajectory(task.pose)
            if scored.free > 0 and self._valid(path, around):
                lowest = float(optimizer.costs.min())
                diagnostics = MppiDiagnostics(scored.free, effective, lowest, scored.furthest_m, resets)
                drawn = (Drawing("cheapest", optimizer.cheapest(self._settings.drawn).astype(np.float64), connected=False),)
                return Plan(optimizer.send(), path_in_odom=path.astype(np.float64), diagnostics=diagnostics, drawings=drawn)
        optimizer.reset()
        reason = "what was averaged collides" if scored.free > 0 else "every trajectory collides"
        return Plan(BodyTwist(), diagnostics=MppiDiagnostics(scored.free, resets=resets, standing=reason))

    def _iterate(self, task: Task, around: Costmap) -> tuple[Scored, float]:
        """Return what the last iteration scored and on how many samples its average rests."""
        for _ in range(self._settings.iteration_count):
            self._optimizer.sample(task.pose)
            scored = self._scorer.score(self._optimizer, task, around)
            effective = self._optimizer.average()
        return scored, effective

    def _valid(self, path: NDArray[np.float32], around: Costmap) -> bool:
        """Whether the sequence's own trajectory is free of collisions as far as it is validated."""
        checked = round(self._settings.validated_s / self._settings.model_dt_s)
        return bool(collision_free(around, path[:checked]).all())
