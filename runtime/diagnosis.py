"""Gathers every fault that is present at a tick, whoever found it, and remembers those that latch."""

from __future__ import annotations

from dataclasses import dataclass, replace

from drivers.interface.commands import BaseLimits
from drivers.interface.sensed import Sensed
from estimators.belief import Belief, EstimatorFault
from planners.planner import Plan
from runtime.fault_board import FaultBoard
from runtime.faults import Fault, FaultReport, Response
from runtime.operator_state import OperatorState
from runtime.sections import DeadlineLadder, SupervisorSection
from runtime.watch import DeviceWatch, WatchState

LATE_SPAN_NS = 2_000_000_000  # over which the share of missed deadlines is told (the time constant of its mean)
_NO_MOTION = 1e-6  # m/s: what a planner's rounding may leave on an axis that the base does not have


@dataclass(frozen=True, slots=True)
class DiagnosisState:
    """What a diagnosis goes on from."""

    latched: FaultReport | None
    misses: int
    missed_share: float
    watch: WatchState


class Diagnosis:
    """Asked once a tick."""

    def __init__(self, settings: SupervisorSection, limits: BaseLimits | None, plan_budget_ns: int, board: FaultBoard) -> None:
        """Start with nothing latched."""
        self._ladder = settings.deadline_ladder
        self._most_missed = settings.most_missed_share
        self._limits = limits
        self._plan_budget_ns = plan_budget_ns
        self._board = board
        self._watch = DeviceWatch(settings)
        self._latched: FaultReport | None = None
        self._misses = 0
        self._missed_share = 0.0

    def faults(self, plan: Plan, belief: Belief, sensed: Sensed, operator: OperatorState) -> list[FaultReport]:
        """Return every fault that is present now, and the one that is latched although it has passed."""
        faults = self._watch.faults(sensed) + operator.faults() + self._board.take()
        faults += [_of_estimator(fault) for fault in belief.faults]
        faults += self._of_plan(plan) + self._of_time(sensed)
        if sensed.truth is not None and sensed.truth.contacts:
            faults.append(FaultReport(Fault.COLLISION, "truth", f"it touches {', '.join(sensed.truth.contacts)}"))
        return self._with_latched(faults, reset=operator.reset)

    @property
    def state(self) -> DiagnosisState:
        """What it goes on from."""
        return DiagnosisState(self._latched, self._misses, self._missed_share, self._watch.state)

    @state.setter
    def state(self, state: DiagnosisState) -> None:
        self._latched, self._misses, self._missed_share = state.latched, state.misses, state.missed_share
        self._watch.state = state.watch

    def _of_plan(self, plan: Plan) -> list[FaultReport]:
        twist = plan.base
        if twist is None or self._limits is None:
            return []
        if not twist.finite:
            return [FaultReport(Fault.NON_FINITE_COMMAND, "planner", f"it asked for {twist}")]
        if not self._limits.holonomic and abs(twist.vy) > _NO_MOTION:
            return [FaultReport(Fault.IMPOSSIBLE_MOTION, "planner", f"it asked for vy = {twist.vy:g} m/s of a base without")]
        return []

    def _of_time(self, sensed: Sensed) -> list[FaultReport]:
        tick, budget_ns, found = sensed.tick, self._plan_budget_ns, []
        if tick.last_plan_ns > budget_ns:
            took = f"it took {tick.last_plan_ns / 1e6:.1f} ms of {budget_ns / 1e6:.1f} ms"
            found.append(FaultReport(Fault.PLANNER_OVER_BUDGET, "planner", took))
        self._misses = self._misses + tick.skipped if tick.skipped else 0
        rung = ladder_rung(self._ladder, self._misses)
        if rung is not None:
            found.append(FaultReport(rung, "loop", f"{self._misses} deadlines missed in a row"))
        self._missed_share = missed_share(self._missed_share, tick.skipped, tick.period_ns)
        if self._missed_share > self._most_missed and worst(found) < Response.DECELERATE:
            found.append(
                FaultReport(Fault.DEADLINE_SLOWED, "loop", f"{self._missed_share:.0%} of the last deadlines were missed")
            )
        return found

    def _with_latched(self, faults: list[FaultReport], *, reset: bool) -> list[FaultReport]:
        if reset:
            self._latched = None
        latching = next((report for report in faults if report.response is Response.LATCH), None)
        if latching is not None and self._latched is None:
            self._latched = latching
        if self._latched is not None and latching is None:
            return [*faults, replace(self._latched, detail="latched until the operator resets")]
        return faults


def worst(faults: list[FaultReport]) -> Response:
    """Return the most severe response that the faults ask for."""
    return max((report.response for report in faults), default=Response.RUN)


def missed_share(share: float, missed: int, period_ns: int) -> float:
    """Return the running mean of missed deadlines after so many more, and one that was met."""
    kept = 1.0 - min(period_ns / LATE_SPAN_NS, 1.0)
    return kept * (1.0 - (1.0 - share) * kept**missed)


def ladder_rung(ladder: DeadlineLadder, misses: int) -> Fault | None:
    """Return the rung that so many consecutive misses reach."""
    if misses == 0:
        return None
    rungs = (
        (ladder.latch, Fault.DEADLINE_LATCHED),
        (ladder.stop, Fault.DEADLINE_STOPPED),
        (ladder.decelerate, Fault.DEADLINE_SLOWED),
        (ladder.hold, Fault.DEADLINE_HELD),
    )
    return next((fault for threshold, fault in rungs if misses >= threshold), Fault.DEADLINE_TOLERATED)


def _of_estimator(fault: EstimatorFault) -> FaultReport:
    diverged = fault is EstimatorFault.DIVERGED
    return FaultReport(Fault.ESTIMATOR_DIVERGED if diverged else Fault.INVALID_VALUES, "estimator", fault.value)
