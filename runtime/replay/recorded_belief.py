"""Tick by tick from the recorded beliefs: what one stage comes to otherwise than recorded does not reach the next one.

A log holds pose, twist and tracks to the bit, of grid and clearance field only checksums.  The fields are therefore those that
the estimator makes anew from the recorded samples; all else that a stage is given is what was recorded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from drivers.interface.mission import Mission
from drivers.interface.sensed import Sensed
from estimators.belief import Belief
from planners.planner import Plan
from planners.router import Route
from runtime.cycle import Cycle, Verdict
from runtime.log.exact.block import Row
from runtime.loop import Stages


class RecordedBeliefs:
    """Feeds every stage what was recorded, and keeps what it answered for the comparison."""

    def __init__(self, row: Callable[[], Row]) -> None:
        """Take what returns the present tick's row."""
        self._row = row
        self._belief: Belief | None = None
        self._route: Route | None = None
        self._plan: Plan | None = None

    def around(self, stages: Stages) -> Stages:
        """Return the stages with what is recorded between them; `record` gets what they answered."""

        def estimate(sensed: Sensed) -> Belief:
            self._belief = own = stages.estimate(sensed)
            recorded: Belief = self._row().decided("belief")
            return replace(recorded, grid=own.grid, clearance=own.clearance)

        def route(belief: Belief, mission: Mission) -> Route:
            self._route = stages.route(belief, mission)
            recorded: Route = self._row().decided("route")
            return recorded

        def plan(belief: Belief, way: Route) -> Plan:
            self._plan = stages.plan(belief, way)
            recorded: Plan = self._row().decided("plan")
            return recorded

        def admit(asked: Plan, belief: Belief, sensed: Sensed) -> Verdict:
            return stages.admit(asked, belief, sensed)

        def record(cycle: Cycle) -> None:
            assert self._belief is not None
            assert self._route is not None
            assert self._plan is not None
            stages.record(replace(cycle, belief=self._belief, route=self._route, plan=self._plan))

        return replace(stages, estimate=estimate, route=route, plan=plan, admit=admit, record=record)
