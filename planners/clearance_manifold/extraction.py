"""Layer 2: ridge and box per station, then the quadratic program; from scratch, or repaired around a prediction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.belief import F64
from planners.clearance_manifold.branch_kernels import cheapest_branch, cost_along, encounters, station_costs
from planners.clearance_manifold.manifold import Manifold, Stations, points_of
from planners.clearance_manifold.offset_qp import FAR_M, OffsetProgram
from planners.clearance_manifold.ridge_kernels import (
    Demand,
    Ground,
    Sections,
    along_manifold,
    ample_boxes,
    boxes,
    profiles,
    repair_all,
)
from planners.clearance_manifold.settings import SolverSettings, TrackerSettings
from planners.planner import PlannerSetup

CURVATURE_LENGTH_M = 0.5  # at which curvature costs as much as slope
CENTRING = 0.05
TURN = 1.5
ENCOUNTER_S = 3.0  # how far ahead a side is chosen for
LIKING = 0.3
IN_TIME = 0.4  # of the time until the robot is at a station, or what closes in: by then it has as much room as there is
SOONEST_S = 0.2  # the paper's step


@dataclass(frozen=True, slots=True)
class Scene:
    """What a manifold is laid through at one tick."""

    ground: Ground
    sections: Sections
    arcs_m: F64  # (n,), of the stations, on the chart
    confidence: F64  # (n,), of the observation at the centre line
    robot_m: float  # lateral offset of the robot
    robot: F64  # (2,), in odom
    end: int  # stations from here on lie beyond the goal and ask for nothing
    speed_m_s: float  # the fastest that the robot arrives with
    closing: F64  # (SLOTS, 5), what closes in (`nearest_closing`), 0 cells where nothing does


@dataclass(frozen=True, slots=True)
class Prior:
    """The manifold of the frame before, at this frame's stations."""

    offset_m: F64  # (n,)
    duals: F64  # (n,)


class Solver:
    """The two-stage solver of section 4.2 and the repairing one of section 4.4."""

    def __init__(self, settings: SolverSettings, tracker: TrackerSettings, stations: Stations, setup: PlannerSetup) -> None:
        """Set both programs up."""
        s, period_s = settings, setup.period_s
        self._settings, self._tracker, self._stations = settings, tracker, stations
        self.own = stations.own
        self.least_m = setup.robot_radius_m + s.margin_m
        kept_m = max(self.least_m, setup.kept_clear_m)
        ample_m = kept_m + s.ample_m
        self._demand = Demand(self.least_m, kept_m, ample_m, max(s.ridge_enough_m, ample_m), CENTRING)
        self._period_s, self._step_towards_m = period_s, tracker.lipschitz_m_s * period_s
        self._offsets = np.linspace(-s.half_width_m, s.half_width_m, s.cross_samples)
        self._spacing = np.diff(stations.arcs_m[stations.own :])
        self._step_m = 2.0 * s.half_width_m / (s.cross_samples - 1)
        temporal = tracker.weight_temporal * 0.2 / period_s
        self._free = OffsetProgram(stations.arcs_m, (s.weight_data, s.weight_homotopy), s.weight_smooth, CURVATURE_LENGTH_M)
        self._bound = OffsetProgram(
            stations.arcs_m, (s.weight_data, s.weight_homotopy, temporal), s.weight_smooth, CURVATURE_LENGTH_M
        )

    def branch(self, scene: Scene, liked: F64 | None) -> tuple[F64, float]:
        """Return the best branch ahead, shape (forward + 1,), and what the branch followed so far costs more per station [m].

        Args:
            scene: what it is laid through.
            liked: offsets followed so far, shape (n,), NaN where there are none; they are preferred.
        """
        own, costs = self._stations.own, self._costs(scene)
        if liked is not None:
            wanted = liked[own : scene.end, None]
            costs += np.where(np.isfinite(wanted), LIKING * np.abs(self._offsets - wanted), 0.0)
        spacing = self._spacing[: len(costs) - 1]
        y, least = cheapest_branch(costs, self._offsets, spacing, scene.robot_m, TURN)
        beyond = np.full(len(scene.arcs_m) - scene.end, np.nan)
        if liked is None or not np.isfinite(liked).all():
            return np.concatenate((y, beyond)), 0.0
        now = cost_along(costs, self._offsets, spacing, scene.robot_m, TURN, liked[own : scene.end])
        return np.concatenate((y, beyond)), (now - least) / len(y)

    def better(self, scene: Scene, followed: F64, valid: int) -> bool:
        """Return whether a branch that leads another way is better by `switch_gain_m` per station than the one followed.

        One that leads the same way has rho_min half way between the two; the repair gets there without a jump.

        Args:
            scene: what it is laid through.
            followed: offsets, shape (n,).
            valid: stations from the robot's own on at which the two are compared.
        """
        best, gain_m = self.branch(scene, followed)
        if gain_m <= self._tracker.switch_gain_m:
            return False
        ahead = slice(self._stations.own, self._stations.own + valid)
        between = Sections(*(part[ahead] for part in scene.sections))
        room = along_manifold(scene.ground, points_of(between, 0.5 * (followed[ahead] + best[:valid])))
        return bool((room < self.least_m).any())

    def _costs(self, scene: Scene) -> F64:
        """Return the costs of all stations ahead and offsets, shape (n, m)."""
        ahead = Sections(*(part[self._stations.own : scene.end] for part in scene.sections))
        apart = encounters(ahead, self._offsets, scene.robot, scene.speed_m_s, ENCOUNTER_S, scene.closing)
        return np.asarray(station_costs(profiles(scene.ground, ahead, self._offsets), apart, self._offsets, self._demand))

    def pays(self, scene: Scene) -> float:
        """Return what the best branch costs per station, whatever was followed so far [m]."""
        costs = self._costs(scene)
        return float(cheapest_branch(costs, self._offsets, self._spacing[: len(costs) - 1], scene.robot_m, TURN)[1]) / len(costs)

    def extract(self, scene: Scene, prior: Prior | None) -> Manifold:
        """Return the manifold of the two-stage solver; with a prior, the branch followed so far is preferred."""
        ahead, _ = self.branch(scene, None if prior is None else prior.offset_m)
        own = self._stations.own
        inside = np.concatenate((np.full(own, ahead[0] if prior is None else np.nan), ahead))
        if prior is not None:
            inside[:own] = prior.offset_m[:own]
        found = self._boxes(scene, inside, None)
        return self._solve(scene, self._free, found, (inside,), inside, np.zeros(len(inside)))[0]

    def repair(self, scene: Scene, prior: Prior, tubes_m: F64) -> tuple[Manifold, F64, int, bool]:
        """Return the repaired manifold, its multipliers, how many stations from the own on could be repaired, and convergence."""
        inside, repaired = repair_all(
            scene.ground, scene.sections, prior.offset_m, tubes_m, self._stations.own, self._tracker.hysteresis, self._demand
        )
        own, n = self._stations.own, len(inside)
        repaired = min(repaired, scene.end - own)
        inside[scene.end :] = np.nan
        if 0 < repaired < scene.end - own:  # regrow the suffix from the last valid station
            liked = np.where(np.arange(n) < own + repaired, prior.offset_m, np.nan)
            regrown, _ = self.branch(scene, liked)
            inside[own + repaired :] = regrown[repaired:]
        found = self._boxes(scene, inside, prior.offset_m)
        near = np.where(np.isfinite(found[:, 2]), found[:, 2], prior.offset_m)
        ridge = np.clip(near, prior.offset_m - tubes_m, prior.offset_m + tubes_m)
        ridge[own + repaired :] = near[own + repaired :]
        found[:, 2] = np.where(np.isfinite(found[:, 2]), ridge, np.nan)
        references = (prior.offset_m, prior.offset_m)
        manifold, duals, converged = self._solve(scene, self._bound, found, references, prior.offset_m, prior.duals)
        return manifold, duals, repaired, converged

    def _boxes(self, scene: Scene, inside: F64, around: F64 | None) -> F64:
        """Return the boxes of proposition 1, the ridges, and what is kept to inside of the boxes: low, high, shape (n, 5) [m].

        That is the ample part of the box (`ample_boxes`); who is outside of it at `around`, shape (n,), comes towards it in time
        for the robot, and no faster than P4 allows.
        """
        found = boxes(scene.ground, scene.sections, inside, self._step_m, self._demand)
        kept = ample_boxes(scene.ground, scene.sections, found, self._step_m, self._demand)
        if around is not None:
            step_m = self._towards(np.fmax(kept[:, 0] - around, around - kept[:, 1]), scene)
            kept[:, 0] = np.maximum(found[:, 0], np.minimum(kept[:, 0], around + step_m))
            kept[:, 1] = np.minimum(found[:, 1], np.maximum(kept[:, 1], around - step_m))
        return np.hstack((found, kept))

    def _towards(self, away_m: F64, scene: Scene) -> F64:
        """Return how far stations that are `away_m`, shape (n,), from their ample room come towards it in this tick.

        What is far ahead has time: noise there moves the manifold little, and a better view corrects it.
        """
        meet_m_s = scene.speed_m_s + float(np.hypot(scene.closing[:, 2], scene.closing[:, 3]).max())
        within_s = np.maximum(IN_TIME / meet_m_s * np.abs(self._stations.arcs_m), SOONEST_S)
        return np.asarray(np.fmin(np.fmax(away_m, 0.0) * (self._period_s / within_s), self._step_towards_m))

    def _solve(
        self, scene: Scene, program: OffsetProgram, found: F64, references: tuple[F64, ...], start: F64, duals: F64
    ) -> tuple[Manifold, F64, bool]:
        own = self._stations.own
        wide = np.isfinite(found[:, 2])
        valid = int(len(wide) - own if wide[own:].all() else np.argmin(wide[own:]))
        binds = wide & (np.arange(len(wide)) < own + valid)
        binds[:own] &= scene.confidence[:own] >= self._settings.rear_confidence
        low, high = np.where(binds, found[:, 0], -FAR_M), np.where(binds, found[:, 1], FAR_M)
        kept_low, kept_high = np.where(binds, found[:, 3], -FAR_M), np.where(binds, found[:, 4], FAR_M)
        ridge = _filled(np.where(binds, found[:, 2], np.nan), scene.robot_m)
        anchors = tuple(np.where(binds, ref, ridge) for ref in references)
        begin = np.where(np.isfinite(start), start, ridge)
        offset, duals, converged = program.solve((ridge, *anchors), kept_low, kept_high, begin, duals)
        points = points_of(scene.sections, offset)
        clearance = along_manifold(scene.ground, points)
        whole = own + valid >= scene.end
        return Manifold(scene.arcs_m, offset, points, low, high, ridge, clearance, valid, own, whole), duals, converged


def _filled(values: F64, otherwise: float) -> F64:
    """Return the values, those missing as the nearest station that has one."""
    good = np.flatnonzero(np.isfinite(values))
    if not good.size:
        return np.full_like(values, otherwise)
    return np.asarray(np.interp(np.arange(len(values)), good, values[good]))
