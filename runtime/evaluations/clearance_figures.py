"""What the clearance paper's tables ask of a run: M1 to M6, P1 to P6 and times, gathered cycle by cycle.

Source: Cui, Deng, Wang, section 6 (M1 tracking utilisation, M2 temporal deviation, M3 fallback rates, M4 safety margin, M5
collisions, M6 RMS jerk) and appendices E and F.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import SE2
from planners.clearance_manifold.diagnostics import ManifoldDiagnostics
from runtime.cycle import Cycle
from runtime.report import RunReport

JERK_STEP_S = 0.2  # the paper's control period: commands are compared at this distance, however fast the loop is
PROPERTIES = ("p1", "p2", "p3", "p4", "p5", "p6")
FALLBACKS = ("task_reset", "sensing_failure", "regular_continuation_failure")


@dataclass(frozen=True, slots=True)
class ClearanceFigures:
    """One run; None where the planner has no manifold or the world no truth.  Shares are of the ticks with a manifold."""

    outcome: str
    duration_s: float
    path_length_m: float
    surface_m: float | None  # least clearance, from the robot's surface
    centre_m: float | None  # the same, from its centre
    jerk_rms_m_s3: float
    tracking: float | None
    fallbacks: dict[str, float] | None  # share by category, in the order of FALLBACKS
    deviation_mean_m: float | None
    deviation_p95_m: float | None
    properties: dict[str, float] | None  # share by property
    plan_mean_ms: float
    plan_p99_ms: float
    estimate_mean_ms: float
    estimate_p99_ms: float
    admit_mean_ms: float
    admit_p99_ms: float


class FigureCollector:
    """Sees every cycle of a run."""

    def __init__(self) -> None:
        """Start with none."""
        self._said: list[ManifoldDiagnostics] = []
        self._sent: list[tuple[float, float]] = []  # velocity in odom [m/s], every JERK_STEP_S
        self._next_ns: int | None = None

    def see(self, cycle: Cycle) -> None:
        """Take one cycle into account."""
        said, now_ns = cycle.plan.diagnostics, cycle.sensed.tick.start_ns
        if isinstance(said, ManifoldDiagnostics) and not said.refused:
            self._said.append(said)
        if self._next_ns is not None and now_ns < self._next_ns:
            return
        self._next_ns = now_ns + round(JERK_STEP_S * 1e9)
        twist = cycle.verdict.command.base
        if twist is not None:
            velocity = SE2(0.0, 0.0, cycle.belief.odom_from_base.yaw).apply(np.array([twist.vx, twist.vy]))
            self._sent.append((float(velocity[0]), float(velocity[1])))

    def figures(self, report: RunReport, radius_m: float) -> ClearanceFigures:
        """Return the run's figures."""
        said, times, surface_m = self._said, report.stage_ms, report.min_clearance_m
        deviations = np.array([d.deviation_m for d in said if d.fallback_category != "cold_start"])
        return ClearanceFigures(
            outcome=report.outcome,
            duration_s=report.duration_s,
            path_length_m=report.path_length_m,
            surface_m=surface_m,
            centre_m=None if surface_m is None else surface_m + radius_m,
            jerk_rms_m_s3=jerk_rms(np.array(self._sent), JERK_STEP_S),
            tracking=_share([d.tracking for d in said]),
            fallbacks={name: _of(said, name) for name in FALLBACKS} if said else None,
            deviation_mean_m=float(deviations.mean()) if deviations.size else None,
            deviation_p95_m=float(np.percentile(deviations, 95.0)) if deviations.size else None,
            properties={name: float(np.mean([getattr(d, name) for d in said])) for name in PROPERTIES} if said else None,
            plan_mean_ms=times["plan"].mean,
            plan_p99_ms=times["plan"].p99,
            estimate_mean_ms=times["estimate"].mean,
            estimate_p99_ms=times["estimate"].p99,
            admit_mean_ms=times["admit"].mean,
            admit_p99_ms=times["admit"].p99,
        )


def jerk_rms(velocity: NDArray[np.float64], step_s: float) -> float:
    """Return the RMS of the second difference quotient of velocities, shape (n, 2) [m/s]; 0 for fewer than three [m/s^3].

    >>> jerk_rms(np.array([[0.0, 0.0], [0.1, 0.0], [0.4, 0.0]]), 0.2)
    5.0
    """
    if len(velocity) < 3:
        return 0.0
    jerk = np.diff(velocity, n=2, axis=0) / step_s**2
    return round(math.sqrt(float(np.mean((jerk**2).sum(axis=1)))), 9)


def _share(flags: list[bool]) -> float | None:
    return float(np.mean(flags)) if flags else None


def _of(said: list[ManifoldDiagnostics], category: str) -> float:
    return float(np.mean([d.fallback_category == category for d in said]))
