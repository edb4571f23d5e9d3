"""Keeps the loop going when a part of it raises: the failure becomes a fault, and a harmless answer takes its place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from drivers.interface.errors import TrundleError
from drivers.interface.mission import Mission
from drivers.interface.sensed import Sensed
from estimators.belief import Belief
from estimators.estimator import Estimator
from planners.planner import no_path
from planners.router import Route, Router
from runtime.fault_board import FaultBoard
from runtime.faults import Fault, FaultReport

T = TypeVar("T")


def report(error: Exception, fault: Fault, part: str) -> FaultReport:
    """Return the fault that an exception is."""
    return FaultReport(fault, part, f"{type(error).__name__}: {error}")


def checked(answer: T, expected: type[T]) -> T:
    """Return the answer of a part, or raise what a part that forgot to answer deserves.

    Raises:
        TypeError: it is something else.
    """
    if not isinstance(answer, expected):
        raise TypeError(f"it returned {answer!r:.80}, not a {expected.__name__}")
    return answer


def guarded_update(estimator: Estimator, board: FaultBoard) -> Callable[[Sensed], Belief]:
    """Return `estimator.update` that answers with the last belief when it raises.

    Where there is no last belief, at the very first tick, it raises a TrundleError: the robot has not moved, and the run ends.
    """
    last: Belief | None = None

    def update(sensed: Sensed) -> Belief:
        nonlocal last
        try:
            last = checked(estimator.update(sensed), Belief)
        except Exception as error:
            if last is None:
                raise TrundleError(f"the estimator failed at the first tick: {type(error).__name__}: {error}") from error
            board.post(report(error, Fault.ESTIMATOR_RAISED, "estimator"))
            last = replace(last, tick=sensed.tick.index, stamp_ns=sensed.tick.start_ns)
        return last

    return update


def guarded_route(router: Router, board: FaultBoard) -> Callable[[Belief, Mission], Route]:
    """Return `router.route` that answers with no route when it raises."""

    def route(belief: Belief, mission: Mission) -> Route:
        try:
            return checked(router.route(belief, mission), Route)
        except Exception as error:  # noqa: BLE001 - a router is anyone's code; its failure must stop the robot, not the loop
            board.post(report(error, Fault.ROUTER_RAISED, "router"))
            return Route(None, no_path(), 0.0, blocked=True)

    return route
