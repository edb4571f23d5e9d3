"""One run of a navigation evaluation: what it cost, by the truth of the simulator."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from drivers.interface.mission import Goal
from drivers.interface.settings import Settings
from runtime.cycle import Cycle
from runtime.referee import Outcome
from runtime.report import RunReport
from runtime.watch import SECOND_NS


class CostSettings(Settings):
    """What counts as unsafe or hesitant.

    The RCSP paper's safety cost "accumulates conservative slow-motion and proximity exposure" (Han, Zhu, section 5.2), without
    thresholds or unit; ours is the time [s] spent near anything or slow, so that its size is not the paper's.
    """

    near_m: float = Field(default=0.20, gt=0.0, le=5.0, description="less clearance, surface to surface, is near")
    slow_m_s: float = Field(default=0.05, ge=0.0, le=2.0, description="less speed is slow")


@dataclass(frozen=True, slots=True)
class Episode:
    """How one run ended and what it cost."""

    outcome: str
    hit_while_standing: bool
    duration_s: float
    path_length_m: float
    min_clearance_m: float | None  # signed, surface to surface; none: there was nothing
    safety_cost_s: float
    spl: float  # success weighted by path length
    latency_ms: float  # mean of what planner and shield took a tick
    jerk_m_s3: float  # mean size of the jerk of the forward speed that was sent
    final_distance_m: float  # from the last goal

    @property
    def succeeded(self) -> bool:
        """Whether all goals were reached."""
        return self.outcome == Outcome.REACHED.value

    @property
    def collided(self) -> bool:
        """Whether it ended in a collision, whoever moved."""
        return self.outcome == Outcome.COLLIDED.value

    @property
    def unfinished(self) -> bool:
        """Whether it ran out of time, or the supervisor stopped it for good."""
        return not self.succeeded and not self.collided

    @property
    def score(self) -> float:
        """Success - collision - 0.10 time-out - 0.03 safety cost (Han, Zhu, table 1)."""
        return self.succeeded - self.collided - 0.10 * self.unfinished - 0.03 * self.safety_cost_s


class EpisodeMeter:
    """Looks at every cycle of a run; made for `RunOptions.progress`."""

    def __init__(self, settings: CostSettings, goals: tuple[Goal, ...]) -> None:
        """Start before the first tick."""
        self._settings, self._goals = settings, goals
        self._sent_m_s: list[float] = []
        self._cost_s = self._period_s = 0.0
        self._final_distance_m = math.nan

    def see(self, cycle: Cycle) -> None:
        """Take one cycle into account."""
        truth, sent, settings = cycle.sensed.truth, cycle.verdict.command.base, self._settings
        self._period_s = cycle.sensed.tick.period_ns / SECOND_NS
        self._sent_m_s.append(0.0 if sent is None else sent.vx)
        if truth is None:
            return
        if truth.clearance_m < settings.near_m or truth.twist.speed_m_s < settings.slow_m_s:
            self._cost_s += self._period_s
        if self._goals:
            pose, goal = truth.map_from_base, self._goals[-1]
            self._final_distance_m = math.hypot(goal.x_m - pose.x, goal.y_m - pose.y)

    def episode(self, report: RunReport, shortest_m: float) -> Episode:
        """Return what the run came to, whose shortest way is so long."""
        jerk = np.diff(self._sent_m_s, n=2) / self._period_s**2 if len(self._sent_m_s) > 2 else np.zeros(1)
        reached = report.outcome == Outcome.REACHED.value
        return Episode(
            outcome=report.outcome,
            hit_while_standing=report.hit_while_standing,
            duration_s=report.duration_s,
            path_length_m=report.path_length_m,
            min_clearance_m=report.min_clearance_m,
            safety_cost_s=self._cost_s,
            spl=reached * shortest_m / max(report.path_length_m, shortest_m, 1e-9),
            latency_ms=sum(report.stage_ms[stage].mean for stage in ("plan", "admit")),
            jerk_m_s3=float(np.mean(np.abs(jerk))),
            final_distance_m=self._final_distance_m,
        )
