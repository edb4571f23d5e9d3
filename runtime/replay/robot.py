"""The recorded robot: what it senses is what was sensed, and its beat is the recorded one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import Future

from drivers.interface.commands import Command
from drivers.interface.sensed import Sensed, Tick
from estimators.belief import Belief
from planners.planner import Plan
from runtime.fault_board import FaultBoard
from runtime.faults import Fault, FaultReport
from runtime.log.exact.block import Row


class RecordedRobot:
    """Stands where a `Robot` stands: iterates over the recorded ticks, and reads what was sensed at each.

    What else came from outside at a tick, it supplies too: it posts the reports that were given, and says of a background
    plan whether it was ready.
    """

    def __init__(self, *, same_planner: bool) -> None:
        """Start before the first tick; `same_planner`: a plan that was late in the recording is late again."""
        self.board = FaultBoard()  # to be that of the parts, which are built with `ready`
        self._same_planner = same_planner
        self._late = False
        self._sensed: Sensed | None = None
        self.row: Row | None = None  # that of the present tick

    def ticks(self, rows: Iterable[Row]) -> Iterator[Tick]:
        """Yield the recorded ticks."""
        for row in rows:
            self.row, self._sensed = row, row.sensed
            yield self._sensed.tick

    def read(self, tick: Tick) -> Sensed:
        """Return what was sensed, after posting what was given."""
        assert self._sensed is not None
        given = self.present().given
        self._late = self._same_planner and any(map(is_late_plan, given))
        for report in given:
            if not is_late_plan(report):
                self.board.post(report, given=True)
        return self._sensed

    def present(self) -> Row:
        """Return the row of the present tick."""
        assert self.row is not None
        return self.row

    def write(self, command: Command) -> None:
        """Do nothing: what was driven was driven."""

    def budget(self, belief: Belief) -> int:
        """Return how long the planner was given at the present tick [ns]."""
        return self.present().budget_ns

    def ready(self, tick: int, plan: Future[Plan]) -> bool:
        """Say whether a background plan that is due was ready in the recording; one that was is waited for."""
        return not self._late


def is_late_plan(report: FaultReport) -> bool:
    """Tell the runner's report of a background plan that is not ready from others that were given."""
    return report.fault is Fault.PLANNER_OVER_BUDGET
