"""How the planner is called: guarded, every n-th tick, and with a latency that is kept exactly."""

import threading

import pytest

from drivers.interface.commands import BodyTwist
from planners.planner import Plan, no_path
from planners.router import Route
from runtime.fault_board import FaultBoard
from runtime.faults import Fault
from runtime.planning import NO_PLAN, PlannerRunner, as_it_stands, awaited
from tests.runtime.cycles import belief

ROUTE = Route(None, no_path(), 0.0)


class Counting:
    """A planner whose plan tells at which tick it was made."""

    def __init__(self) -> None:
        self.calls: list[int] = []

    def plan(self, belief: object, route: Route) -> Plan:
        self.calls.append(belief.tick)
        return Plan(base=BodyTwist(float(belief.tick), 0.0, 0.0))


class Raising(Counting):
    def plan(self, belief: object, route: Route) -> Plan:
        if belief.tick == 2:
            raise RuntimeError("no candidate left")
        return super().plan(belief, route)


def speeds(runner: PlannerRunner, ticks: range) -> list[float | None]:
    plans = [runner.plan(belief(k), ROUTE) for k in ticks]
    return [None if plan.base is None else plan.base.vx for plan in plans]


def runner(planner: Counting, board: FaultBoard, period: int = 1, latency: int = 0, lockstep: bool = True) -> PlannerRunner:
    return PlannerRunner(planner, board, period_ticks=period, latency_ticks=latency, ready=awaited if lockstep else as_it_stands)


def test_every_third_tick_is_planned_and_the_plan_stays_in_force_between() -> None:
    planner = Counting()
    assert speeds(runner(planner, FaultBoard(), period=3), range(7)) == [0, 0, 0, 3, 3, 3, 6]
    assert planner.calls == [0, 3, 6]


def test_a_planner_that_raises_leaves_no_plan_and_word_of_it_and_is_asked_again() -> None:
    board = FaultBoard()
    assert speeds(runner(Raising(), board), range(5)) == [0, 1, None, 3, 4]
    (report,) = board.take()
    assert report.fault is Fault.PLANNER_RAISED
    assert report.detail == "RuntimeError: no candidate left"


@pytest.mark.parametrize("latency", [1, 2, 4])
def test_in_lockstep_a_plan_takes_effect_exactly_its_latency_later(latency: int) -> None:
    board = FaultBoard()
    background = runner(Counting(), board, latency=latency)
    got = speeds(background, range(3 * latency))
    background.close()
    assert got == [None] * latency + [0] * latency + [latency] * latency
    assert not board.take()


def test_in_real_time_a_plan_that_is_not_ready_is_a_fault_until_it_is() -> None:
    release, board = threading.Event(), FaultBoard()

    class Slow(Counting):
        def plan(self, belief: object, route: Route) -> Plan:
            release.wait(10)
            return super().plan(belief, route)

    slow = runner(Slow(), board, latency=2, lockstep=False)
    assert speeds(slow, range(3)) == [None, None, None]
    assert [report.fault for report in board.take()] == [Fault.PLANNER_OVER_BUDGET]
    future = slow._pending[1]
    release.set()
    future.result(10)
    assert speeds(slow, range(3, 4)) == [0]
    assert not board.take()
    slow.close()


def test_no_plan_asks_for_nothing() -> None:
    assert NO_PLAN.base is None
    assert NO_PLAN.arm is None


class Hurrying(Counting):
    """A planner whose plan tells how long it was given [ns]."""

    def plan_within(self, belief: object, route: Route, budget_ns: int) -> Plan:
        if budget_ns < 0:
            raise RuntimeError("no time at all")
        return Plan(base=BodyTwist(float(budget_ns), 0.0, 0.0))


@pytest.mark.parametrize("latency", [0, 1])
def test_an_anytime_planner_is_told_how_long_it_has_and_the_plan_says_what_it_was_told(latency: int) -> None:
    left = iter([7, -1, 5, 3])
    told = PlannerRunner(
        Hurrying(), FaultBoard(), period_ticks=1, latency_ticks=latency, ready=awaited, budget=lambda belief: next(left)
    )
    plans = [told.plan(belief(k), ROUTE) for k in range(4)][latency:]
    told.close()
    assert [plan.budget_ns for plan in plans] == [7, -1, 5, 3][: len(plans)]
    assert [plan.base and plan.base.vx for plan in plans] == [7.0, None, 5.0, 3.0][: len(plans)]


def test_other_planners_are_not_told_but_the_log_still_holds_it() -> None:
    told = PlannerRunner(Counting(), FaultBoard(), period_ticks=1, latency_ticks=0, ready=awaited, budget=lambda belief: 9)
    assert told.plan(belief(0), ROUTE) == Plan(
        base=BodyTwist(), path_in_odom=told.plan(belief(0), ROUTE).path_in_odom, budget_ns=9
    )
