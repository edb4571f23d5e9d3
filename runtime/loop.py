"""The program on one screen: sense, estimate, route, plan, admit, write, record; tick after tick."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from drivers.interface.commands import Command
from drivers.interface.mission import Mission
from drivers.interface.sensed import Sensed, Tick
from estimators.belief import Belief
from planners.planner import Plan
from planners.router import Route
from runtime.cycle import Cycle, Verdict
from runtime.stopwatch import Stopwatch


@dataclass(frozen=True, slots=True)
class Stages:
    """What the loop calls, one function a stage."""

    sense: Callable[[Tick], Sensed]
    estimate: Callable[[Sensed], Belief]
    route: Callable[[Belief, Mission], Route]
    plan: Callable[[Belief, Route], Plan]
    admit: Callable[[Plan, Belief, Sensed], Verdict]
    write: Callable[[Command], None]
    record: Callable[[Cycle], None]

    def timed(self, stopwatch: Stopwatch) -> Stages:
        """Return the same stages with their durations taken."""
        t = stopwatch.timed
        return Stages(
            t("sense", self.sense),
            t("estimate", self.estimate),
            t("route", self.route),
            t("plan", self.plan),
            t("admit", self.admit),
            t("write", self.write),
            t("record", self.record),
        )


def run_loop(pacer: Iterable[Tick], stages: Stages, stopwatch: Stopwatch, is_over: Callable[[Cycle], bool]) -> None:
    """Run until `is_over` says so."""
    do = stages.timed(stopwatch)
    for tick in pacer:
        sensed = do.sense(tick)
        belief = do.estimate(sensed)
        route = do.route(belief, sensed.mission)
        plan = do.plan(belief, route)
        verdict = do.admit(plan, belief, sensed)
        do.write(verdict.command)
        cycle = Cycle(sensed, belief, route, plan, verdict, stopwatch.stage_ns())
        do.record(cycle)
        stopwatch.tick_over()
        if is_over(cycle):
            return
