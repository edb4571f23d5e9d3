"""Keeps the loop going when a part of it raises: the failure becomes a fault, and a harmless answer takes its place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from drivers.interface.mission import Mission
from drivers.interface.sensed import Sensed
from estimators.belief import Belief
from estimators.estimator import Estimator
from planners.planner import no_path
from planners.router import Route, Router
from runtime.fault_board import FaultBoard
from runtime.faults import Fault, FaultReport


def report(error: Exception, fault: Fault, part: str) -> FaultReport:
    """Return the fault that an exception is."""
    return FaultReport(fault, part, f"{type(error).__name__}: {error}")


def guarded_update(estimator: Estimator, board: FaultBoard) -> Callable[[Sensed], Belief]:
    """Return `estimator.update` that answers with the last belief when it raises (at the very first tick it still raises)."""
    last: Belief | None = None

    def update(sensed: Sensed) -> Belief:
        nonlocal last
        try:
            last = estimator.update(sensed)
        except Exception as error:
            if last is None:
                raise
            board.post(report(error, Fault.ESTIMATOR_RAISED, "estimator"))
            last = replace(last, tick=sensed.tick.index, stamp_ns=sensed.tick.start_ns)
        return last

    return update


def guarded_route(router: Router, board: FaultBoard) -> Callable[[Belief, Mission], Route]:
    """Return `router.route` that answers with no route when it raises."""

    def route(belief: Belief, mission: Mission) -> Route:
        try:
            return router.route(belief, mission)
        except Exception as error:  # noqa: BLE001 - a router is anyone's code; its failure must stop the robot, not the loop
            board.post(report(error, Fault.ROUTER_RAISED, "router"))
            return Route(None, no_path(), 0.0, blocked=True)

    return route
