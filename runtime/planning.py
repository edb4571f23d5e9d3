"""Calls the planner: guarded, every n-th tick, and in the background when its plans are to take effect later."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace

from estimators.belief import Belief
from planners.planner import Anytime, Plan, Planner
from planners.router import Route
from runtime.background import Background
from runtime.budget import Budget
from runtime.fault_board import FaultBoard
from runtime.faults import Fault, FaultReport
from runtime.guards import checked, report

NO_PLAN = Plan(base=None)
Ready = Callable[[int, Future[Plan]], bool]  # tick and plan to whether it counts as finished at that tick


@dataclass(frozen=True, slots=True)
class RunnerState:
    """What a runner goes on from while no plan is in the making, the planner's own state aside."""

    next_tick: int
    plan: Plan


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """The whole of it."""

    state: RunnerState
    planner: bytes  # its snapshot


def awaited(tick: int, plan: Future[Plan]) -> bool:
    """Say that a plan that is due is finished: whoever asks for it waits."""
    return True


def as_it_stands(tick: int, plan: Future[Plan]) -> bool:
    """Say whether a plan that is due is finished."""
    return plan.done()


class PlannerRunner:
    """`plan` as the loop calls it, every tick.

    With a latency of n ticks a plan that was begun at tick k takes effect at tick k + n, neither earlier nor later: in
    lockstep the loop waits for it, in real time a plan that is not ready then is a fault and the robot stands down.
    """

    def __init__(
        self,
        planner: Planner,
        board: FaultBoard,
        *,
        period_ticks: int,
        latency_ticks: int,
        ready: Ready,
        budget: Budget | None = None,
    ) -> None:
        """Take the planner, what tells whether its plans are ready in time, and how long each may take (none: it is not told)."""
        self._planner = planner
        self._board = board
        self._period = period_ticks
        self._latency = latency_ticks
        self._ready = ready
        self._budget = budget
        self._anytime = planner if isinstance(planner, Anytime) else None
        self._told_ns = 0  # how long the plan in the making, or the last one, was given
        self._next_tick = 0
        self._plan = NO_PLAN
        self._pending: tuple[int, Future[Plan]] | None = None
        self._background = Background[Plan]("planner") if latency_ticks else None
        self._asked = False
        self.checkpoint: Checkpoint | None = None  # taken at the last `plan` that came after `ask_checkpoint`
        self.checkpoint_fault = ""  # why there is none: the planner's snapshot raised

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the plan in force at this tick."""
        self._collect(belief.tick)
        if self._asked:
            self._asked, self.checkpoint = False, self._checkpoint()
        if belief.tick >= self._next_tick and self._pending is None:
            self._next_tick = belief.tick + self._period
            if self._background is None:
                self._plan = self._guarded(self._call(belief, route))
            else:
                self._pending = belief.tick + self._latency, self._background.submit(self._call(belief, route))
        return self._plan

    def is_idle_at(self, tick: int) -> bool:
        """Whether no plan is in the making once those due at a tick have been collected."""
        return self._pending is None or self._pending[0] <= tick

    def ask_checkpoint(self) -> None:
        """Have a checkpoint taken at the next tick, between two plans: only there does nobody else use the planner."""
        self._asked, self.checkpoint = True, None

    @property
    def state(self) -> RunnerState:
        """What it goes on from while no plan is in the making; once set, the next call of `plan` is that of its tick."""
        return RunnerState(self._next_tick, self._plan)

    @state.setter
    def state(self, state: RunnerState) -> None:
        self._next_tick, self._plan, self._pending = state.next_tick, state.plan, None

    def close(self) -> None:
        """Let go of the background thread without waiting for a planner that hangs."""
        if self._background is not None:
            self._background.close()

    def _call(self, belief: Belief, route: Route) -> Callable[[], Plan]:
        """Return the call of the planner, with the time that it has from now on."""
        if self._budget is not None:
            self._told_ns = told_ns = self._budget(belief)
            if (anytime := self._anytime) is not None:
                return lambda: anytime.plan_within(belief, route, told_ns)
        return lambda: self._planner.plan(belief, route)

    def _checkpoint(self) -> Checkpoint | None:
        """Return what to go on from; None while a plan is in the making."""
        if self._pending is not None:
            return None
        try:
            return Checkpoint(self.state, self._planner.snapshot())
        except Exception as error:  # noqa: BLE001 - a planner is anyone's code; its failure costs key frames, not the run
            self.checkpoint_fault = f"no more key frames: the planner's snapshot raised {type(error).__name__}: {error}"
            return None

    def _collect(self, tick: int) -> None:
        if self._pending is None or tick < self._pending[0]:
            return
        due, future = self._pending
        if not self._ready(tick, future):
            late = f"the plan begun {tick - due + self._latency} ticks ago is not ready"
            self._board.post(FaultReport(Fault.PLANNER_OVER_BUDGET, "planner", late), given=True)
            return
        self._pending = None
        self._plan = self._guarded(future.result)

    def _guarded(self, call: Callable[[], Plan]) -> Plan:
        try:
            return replace(checked(call(), Plan), budget_ns=self._told_ns)
        except Exception as error:  # noqa: BLE001 - a planner is anyone's code; its failure must stop the robot, not the loop
            self._board.post(report(error, Fault.PLANNER_RAISED, "planner"))
            return replace(NO_PLAN, budget_ns=self._told_ns)
