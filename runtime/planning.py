"""Calls the planner: guarded, every n-th tick, and in the background when its plans are to take effect later."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future

from estimators.belief import Belief
from planners.planner import Plan, Planner
from planners.router import Route
from runtime.background import Background
from runtime.fault_board import FaultBoard
from runtime.faults import Fault, FaultReport
from runtime.guards import checked, report

NO_PLAN = Plan(base=None)


class PlannerRunner:
    """`plan` as the loop calls it, every tick.

    With a latency of n ticks a plan that was begun at tick k takes effect at tick k + n, neither earlier nor later: in
    lockstep the loop waits for it, in real time a plan that is not ready then is a fault and the robot stands down.
    """

    def __init__(self, planner: Planner, board: FaultBoard, *, period_ticks: int, latency_ticks: int, lockstep: bool) -> None:
        """Take the planner; nothing is called yet."""
        self._planner = planner
        self._board = board
        self._period = period_ticks
        self._latency = latency_ticks
        self._lockstep = lockstep
        self._next_tick = 0
        self._plan = NO_PLAN
        self._pending: tuple[int, Future[Plan]] | None = None
        self._background = Background[Plan]("planner") if latency_ticks else None

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the plan in force at this tick."""
        self._collect(belief.tick)
        if belief.tick >= self._next_tick and self._pending is None:
            self._next_tick = belief.tick + self._period
            if self._background is None:
                self._plan = self._guarded(lambda: self._planner.plan(belief, route))
            else:
                self._pending = belief.tick + self._latency, self._background.submit(lambda: self._planner.plan(belief, route))
        return self._plan

    def close(self) -> None:
        """Let go of the background thread without waiting for a planner that hangs."""
        if self._background is not None:
            self._background.close()

    def _collect(self, tick: int) -> None:
        if self._pending is None or tick < self._pending[0]:
            return
        due, future = self._pending
        if not self._lockstep and not future.done():
            late = f"the plan begun {tick - due + self._latency} ticks ago is not ready"
            self._board.post(FaultReport(Fault.PLANNER_OVER_BUDGET, "planner", late))
            return
        self._pending = None
        self._plan = self._guarded(future.result)

    def _guarded(self, call: Callable[[], Plan]) -> Plan:
        try:
            return checked(call(), Plan)
        except Exception as error:  # noqa: BLE001 - a planner is anyone's code; its failure must stop the robot, not the loop
            self._board.post(report(error, Fault.PLANNER_RAISED, "planner"))
            return NO_PLAN
