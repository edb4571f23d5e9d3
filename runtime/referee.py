"""Judges the run: whether it is over, how it ended, and what it cost.  It only looks; nothing in the loop asks it."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from dataclasses import dataclass, field

from drivers.interface.devices import DeviceState
from drivers.interface.geometry import SE2
from drivers.interface.samples import TruthSample
from runtime.cycle import Cycle
from runtime.faults import Fault, FaultReport, Response
from runtime.mission import MissionTracker
from runtime.watch import SECOND_NS

STANDING_M_S, STANDING_RAD_S = 0.05, 0.1  # slower than this in truth is standing
STANDING_NS = 300_000_000  # who has stood for so long when something touches him was hit, and did not drive into it
STATES_NOT_FAULTS = frozenset({Fault.STARTING, Fault.PAUSED, Fault.NOT_ENABLED})


class Outcome(enum.Enum):
    """How a run can end."""

    REACHED = "reached"
    COLLIDED = "collided"
    TIMED_OUT = "timed_out"
    STOPPED = "stopped"
    INTERRUPTED = "interrupted"


@dataclass(slots=True)
class FaultTally:
    """One fault of one device, over the run."""

    first_tick: int
    first: FaultReport
    ticks: int = 0  # on which it was present


@dataclass(slots=True)
class Tally:
    """What a run cost, so far."""

    ticks: int = 0
    start_ns: int | None = None
    end_ns: int = 0
    path_length_m: float = 0.0
    min_clearance_m: float = math.inf
    hit_while_standing: bool = False
    odometry_error_m: float = math.nan
    odometry_error_rad: float = math.nan
    faults: dict[tuple[Fault, str], FaultTally] = field(default_factory=dict)  # by fault and device, as first seen

    @property
    def duration_s(self) -> float:
        """Time of the run [s], on the loop's clock."""
        return 0.0 if self.start_ns is None else (self.end_ns - self.start_ns) / SECOND_NS


class Referee:
    """Sees every cycle."""

    def __init__(
        self,
        mission: MissionTracker,
        *,
        time_limit_s: float,
        give_up_after_s: float,
        interrupted: Callable[[], bool],
        progress: Callable[[Cycle], None] = lambda _: None,
    ) -> None:
        """Take the mission that is to be accomplished and when to call it off."""
        self.tally = Tally()
        self.outcome: Outcome | None = None
        self._mission = mission
        self._observing = mission.mission.goal is None
        self._time_limit_ns = time_limit_s * SECOND_NS
        self._give_up_ns = give_up_after_s * SECOND_NS
        self._latched_since_ns: int | None = None
        self._interrupted = interrupted
        self._progress = progress
        self._last_pose: SE2 | None = None
        self._moved_ns = 0  # when the robot last moved, by the truth

    def is_over(self, cycle: Cycle) -> bool:
        """Take one cycle into account; return whether it was the last."""
        self._count(cycle)
        self._progress(cycle)
        arrived = self._mission.advance(cycle.belief)
        self.outcome = self._judge(cycle, arrived)
        return self.outcome is not None

    def _judge(self, cycle: Cycle, arrived: bool) -> Outcome | None:
        truth, now_ns = cycle.sensed.truth, cycle.sensed.tick.start_ns
        self._latched_since_ns = self._since(cycle.verdict.response is Response.LATCH, now_ns)
        if self._interrupted():
            return Outcome.INTERRUPTED
        if truth is not None and _touches(truth):
            return Outcome.COLLIDED
        if arrived or cycle.plan.accomplished:
            return Outcome.REACHED
        if self._latched_since_ns is not None and now_ns - self._latched_since_ns >= self._give_up_ns:
            return Outcome.STOPPED
        ended = any(health.state is DeviceState.ENDED for health in cycle.sensed.health)
        if ended or now_ns - (self.tally.start_ns or 0) >= self._time_limit_ns:
            return Outcome.REACHED if self._observing and cycle.plan.accomplished is None else Outcome.TIMED_OUT
        return None

    def _since(self, latched: bool, now_ns: int) -> int | None:
        if not latched:
            return None
        return now_ns if self._latched_since_ns is None else self._latched_since_ns

    def _count(self, cycle: Cycle) -> None:
        tally, tick, truth = self.tally, cycle.sensed.tick, cycle.sensed.truth
        tally.ticks += 1
        tally.start_ns = tick.start_ns if tally.start_ns is None else tally.start_ns
        tally.end_ns = tick.start_ns
        pose = cycle.belief.map_from_base
        if truth is not None:
            tally.min_clearance_m = min(tally.min_clearance_m, truth.clearance_m)
            self._watch_motion(truth, tick.start_ns)
            error = truth.map_from_base.inverse() @ pose
            tally.odometry_error_m, tally.odometry_error_rad = math.hypot(error.x, error.y), abs(error.yaw)
            pose = truth.map_from_base
        if self._last_pose is not None:
            tally.path_length_m += self._last_pose.distance(pose)
        self._last_pose = pose
        for report in cycle.verdict.faults:
            if report.fault not in STATES_NOT_FAULTS:
                tally.faults.setdefault((report.fault, report.device), FaultTally(tick.index, report)).ticks += 1

    def _watch_motion(self, truth: TruthSample, now_ns: int) -> None:
        """Tell a hit on a robot that stands from a collision that it drove into; what touches pushes, so that goes first."""
        if _touches(truth):
            self.tally.hit_while_standing = now_ns - self._moved_ns >= STANDING_NS
        elif truth.twist.speed_m_s >= STANDING_M_S or abs(truth.twist.wz) >= STANDING_RAD_S:
            self._moved_ns = now_ns


def _touches(truth: TruthSample) -> bool:
    return bool(truth.contacts) or truth.clearance_m <= 0.0
