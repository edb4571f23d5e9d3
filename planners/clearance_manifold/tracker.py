"""Continuation: translate, repair, optimise, validate, or fall back to extraction (section 4.4)."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import SE2
from estimators.belief import F64, Belief
from planners.clearance_manifold.chart import Chart
from planners.clearance_manifold.drift import Drift, Past
from planners.clearance_manifold.extraction import Prior, Scene, Solver
from planners.clearance_manifold.manifold import Manifold, Stations, points_of
from planners.clearance_manifold.ridge_kernels import along_manifold
from planners.clearance_manifold.settings import SolverSettings, TrackerSettings

SECOND_NS = 1_000_000_000
PRESSED_M = 0.10  # with less room than this beyond rho_min, other branches are looked at this often
PRESSED_S = 0.2


class Category(enum.Enum):
    """`fallback_category` of the paper's diagnostic, and the first frame, which continues nothing."""

    COLD_START = "cold_start"
    NONE = "none"
    TASK_RESET = "task_reset"
    SENSING_FAILURE = "sensing_failure"
    REGULAR = "regular_continuation_failure"


@dataclass(frozen=True, slots=True)
class Continuation:
    """The manifold of a tick, and how it came about."""

    manifold: Manifold
    category: Category
    trigger: str  # what ended the continuation, in a word or two
    deviation_m: float  # M2: largest distance between the two manifolds at the same station; 0 without one before
    normal_speed_m_s: float  # v_gamma of definition 1, from tick to tick
    drift_m_s: float  # the same over the paper's step of 0.2 s, which P4 bounds
    same_branch: bool  # P3
    converged: bool


class Tracker:
    """Carries the manifold from frame to frame."""

    def __init__(
        self, settings: TrackerSettings, solver_settings: SolverSettings, solver: Solver, stations: Stations, period_s: float
    ) -> None:
        """Start with no manifold."""
        self._settings, self._solver_settings, self._solver, self._stations = settings, solver_settings, solver, stations
        self._period_s, self._drift = period_s, Drift()
        self._step_limit_m = settings.step_share * solver_settings.horizon_m / solver_settings.stations_forward
        self.reset()

    def reset(self) -> None:
        """Forget the manifold."""
        self._drift.reset()
        self._points: F64 = np.zeros((0, 2))
        self._arcs_m: F64 = np.zeros(0)
        self._offset_m: F64 = np.zeros(0)
        self._duals: F64 = np.zeros(len(self._stations.arcs_m))
        self._robot = SE2()
        self._point: F64 = np.zeros(2)  # that follows the manifold
        self._stamp_ns = 0
        self._looked_ns = 0
        self._doubted_ns = 0  # since when another branch is better; 0: none is

    @property
    def tube_m(self) -> float:
        """Radius of the tube that a station is searched in, from one tick to the next."""
        return self._settings.tube_m + self._settings.lipschitz_m_s * self._period_s

    @property
    def holds(self) -> bool:
        """Whether there is a manifold to continue."""
        return len(self._arcs_m) > 0

    def rechart(self, chart: Chart) -> None:
        """Express the manifold, and those before it, on another chart."""
        self._drift.rechart(chart)
        if not self.holds:
            return
        on_chart = chart.project(self._points)
        order = np.argsort(on_chart[:, 0], kind="stable")
        self._arcs_m, self._offset_m = on_chart[order, 0], on_chart[order, 1]

    def advance(self, scene: Scene, belief: Belief, new_goal: bool) -> Continuation:
        """Return this tick's manifold and keep it."""
        elapsed_s = (belief.stamp_ns - self._stamp_ns) / SECOND_NS if self.holds else 0.0
        prior = Prior(np.interp(scene.arcs_m, self._arcs_m, self._offset_m), self._duals) if self.holds else None
        category, trigger = self._broken(scene, belief, new_goal, prior)
        duals, converged = np.zeros(len(scene.arcs_m)), True
        manifold = None
        if prior is not None and category is Category.NONE:
            manifold, duals, converged, trigger = self._continue(scene, prior, max(elapsed_s, self._period_s), belief.stamp_ns)
            category = Category.NONE if manifold is not None else Category.REGULAR
        if manifold is None:
            self._doubted_ns = 0
            keep = prior if category is Category.REGULAR else None
            manifold = self._solver.extract(scene, keep)
            duals = np.zeros(len(scene.arcs_m))
            self._looked_ns = belief.stamp_ns
        deviation_m, speed_m_s, same = self._compare(scene, manifold, prior, elapsed_s)
        drift_m_s = self._drift.speed(belief.stamp_ns, scene.arcs_m[manifold.ahead], manifold.offset_m[manifold.ahead])
        self._keep(scene, manifold, duals, belief)
        return Continuation(manifold, category, trigger, deviation_m, speed_m_s, drift_m_s, same, converged)

    def _broken(self, scene: Scene, belief: Belief, new_goal: bool, prior: Prior | None) -> tuple[Category, str]:
        """Return what forbids to continue before it is tried."""
        s, own = self._settings, self._stations.own
        if prior is None:
            return Category.COLD_START, "no manifold yet"
        if new_goal:
            return Category.TASK_RESET, "goal changed"
        if belief.odom_from_base.distance(self._robot) > s.pose_jump_m:
            return Category.SENSING_FAILURE, "pose jump"
        if abs(float((scene.robot - self._point) @ scene.sections.normal[own])) > s.lateral_m:
            return Category.SENSING_FAILURE, "lateral drift"
        if not s.enabled:
            return Category.REGULAR, "continuation is off"
        if scene.confidence[own + 1 : own + 4].max() < self._solver_settings.rear_confidence:
            return Category.REGULAR, "out of view"
        return Category.NONE, ""

    def _continue(self, scene: Scene, prior: Prior, elapsed_s: float, stamp_ns: int) -> tuple[Manifold | None, F64, bool, str]:
        """Repair and optimise, then validate; no manifold where that fails, with the reason."""
        s, own = self._settings, self._stations.own
        tube_m = s.tube_m + s.lipschitz_m_s * elapsed_s
        tubes_m = np.full(len(scene.arcs_m), tube_m)
        manifold, duals, repaired, converged = self._solver.repair(scene, prior, tubes_m)
        if repaired <= s.repaired_share * (scene.end - own - 1):
            return None, duals, converged, "tube collapsed"
        moved = np.abs(manifold.offset_m - prior.offset_m)[own : own + repaired]
        if moved.max() > self._step_limit_m:
            return None, duals, converged, "overshoot"
        before = points_of(scene.sections, prior.offset_m)
        along, was = np.diff(manifold.points[own : own + repaired + 1], axis=0), np.diff(before[own : own + repaired + 1], axis=0)
        lengths = np.hypot(*along.T) * np.hypot(*was.T)
        if ((along * was).sum(axis=1) < s.tangent_cosine * lengths).any():
            return None, duals, converged, "tangents disagree"
        least = float(manifold.clearance_m[manifold.ahead].min()) if manifold.valid else 0.0
        pressed = least < self._solver.least_m + PRESSED_M
        if self._leaves(scene, prior, min(manifold.valid, scene.end - own), stamp_ns, pressed=pressed):
            return None, duals, converged, "better branch"
        return manifold, duals, converged, ""

    def _leaves(self, scene: Scene, prior: Prior, valid: int, stamp_ns: int, *, pressed: bool) -> bool:
        """Look at other branches when it is time to; return whether one was better for long enough."""
        wait_s = PRESSED_S if pressed or self._doubted_ns else self._solver_settings.skip_s
        if stamp_ns - self._looked_ns < round(wait_s * SECOND_NS):
            return False
        self._looked_ns = stamp_ns
        if not self._solver.better(scene, prior.offset_m, valid):
            self._doubted_ns = 0
            return False
        self._doubted_ns = self._doubted_ns or stamp_ns
        return stamp_ns - self._doubted_ns >= round(self._settings.doubt_s * SECOND_NS)

    def _compare(self, scene: Scene, manifold: Manifold, prior: Prior | None, elapsed_s: float) -> tuple[float, float, bool]:
        if prior is None or not manifold.valid:
            return 0.0, 0.0, True
        apart = manifold.offset_m[manifold.ahead] - prior.offset_m[manifold.ahead]
        deviation = float(np.abs(apart).max())
        middle = points_of(scene.sections, 0.5 * (manifold.offset_m + prior.offset_m))[manifold.ahead]
        same = bool((along_manifold(scene.ground, middle) > 0.0).all())
        return deviation, deviation / elapsed_s if elapsed_s > 0.0 else 0.0, same

    def _keep(self, scene: Scene, manifold: Manifold, duals: F64, belief: Belief) -> None:
        self._points, self._arcs_m, self._offset_m, self._duals = manifold.points, manifold.arcs_m, manifold.offset_m, duals
        self._robot, self._point, self._stamp_ns = belief.odom_from_base, scene.robot, belief.stamp_ns
        self._drift.keep(Past(belief.stamp_ns, manifold.points, manifold.arcs_m, manifold.offset_m))

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is carried on, as named arrays."""
        robot = self._robot
        return {
            "points": self._points,
            "arcs_m": self._arcs_m,
            "offset_m": self._offset_m,
            "duals": self._duals,
            "robot": np.array([robot.x, robot.y, robot.yaw, *self._point]),
            "stamps_ns": np.array([self._stamp_ns, self._looked_ns, self._doubted_ns], np.int64),
            **self._drift.state(),
        }

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._points, self._arcs_m = state["points"], state["arcs_m"]
        self._offset_m, self._duals = state["offset_m"], state["duals"]
        x, y, yaw, *point = state["robot"].tolist()
        self._point = np.array(point)
        self._robot = SE2(x, y, yaw)
        self._stamp_ns, self._looked_ns, self._doubted_ns = (int(stamp) for stamp in state["stamps_ns"])
        self._drift.take(state)


def heading(points: F64) -> float:
    """Return the direction from the first to the last of points, shape (n, 2) [rad]."""
    dx, dy = points[-1] - points[0]
    return math.atan2(dy, dx)
