"""When the robot was stopped: what around these moments is worth keeping, and worth a recording of its own."""

from __future__ import annotations

from runtime.cycle import Cycle
from runtime.faults import Fault, FaultReport, Response

AROUND_S = 10.0  # of the recording that is made of a stop, half of it before
_HALF_NS = round(AROUND_S * 0.5e9)


class Stops:
    """Collects, cycle by cycle, when a fault began that stopped the robot; starting is not one."""

    def __init__(self) -> None:
        """Know of none yet."""
        self.latched_ticks: list[int] = []
        self._begun_ns: list[int] = []
        self._present: frozenset[tuple[Fault, str]] = frozenset()
        self._latched = False

    def put(self, cycle: Cycle) -> None:
        """Take note of what is new at this tick."""
        tick, verdict = cycle.sensed.tick, cycle.verdict
        present = frozenset((report.fault, report.device) for report in verdict.faults if _stops(report))
        if present - self._present:
            self._begun_ns.append(tick.start_ns)
        latched = verdict.response is Response.LATCH
        if latched and not self._latched:
            self.latched_ticks.append(tick.index)
        self._present, self._latched = present, latched

    def any_near(self, first_ns: int, last_ns: int) -> bool:
        """Return whether one began between two times, or close to that."""
        return any(first_ns - _HALF_NS <= begun <= last_ns + _HALF_NS for begun in self._begun_ns)


def _stops(report: FaultReport) -> bool:
    return report.response >= Response.STAND_DOWN and report.fault is not Fault.STARTING
