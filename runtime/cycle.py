"""Everything one tick produced, as the recorder, the report and the comparison take it."""

from dataclasses import dataclass

from drivers.interface.commands import Command
from drivers.interface.sensed import Sensed
from estimators.belief import Belief
from planners.planner import Plan
from planners.router import Route
from planners.shield import Filtered, ReachableSet
from runtime.faults import FaultReport, Response

STAGES = ("sense", "estimate", "route", "plan", "admit", "write", "record")


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the supervisor admitted, and why."""

    command: Command  # what is sent
    asked: Command  # what the planner asked, inside the limits, before the shield
    response: Response
    faults: tuple[FaultReport, ...]
    reachable: ReachableSet
    filtered: Filtered | None  # what the shield made of it; None when it was not consulted
    given: tuple[FaultReport, ...] = ()  # of the faults, those that nothing sensed leads to: an input of the tick


@dataclass(frozen=True, slots=True)
class Cycle:
    """One tick from end to end; everything in it is immutable."""

    sensed: Sensed
    belief: Belief
    route: Route
    plan: Plan
    verdict: Verdict
    stage_ns: tuple[int, ...]  # in the order of STAGES; record is the tick before's (this one's is not over yet)
