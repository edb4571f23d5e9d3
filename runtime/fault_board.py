"""Where a part of the runtime that caught a failure leaves word for the supervisor."""

from runtime.faults import FaultReport


class FaultBoard:
    """Reports of this tick, taken down by the supervisor.

    Most follow from what was sensed, and come again when the loop is run over a recording.  One that does not (a disk that is
    full, a thread that is late) is posted as given: it is an input of its tick, and recorded as such.
    """

    def __init__(self) -> None:
        """Start empty."""
        self._reports: list[tuple[FaultReport, bool]] = []
        self.given: tuple[FaultReport, ...] = ()  # of the reports last taken, those that were posted as given

    def post(self, report: FaultReport, *, given: bool = False) -> None:
        """Leave a report; `given`: nothing that was sensed leads to it."""
        self._reports.append((report, given))

    def take(self) -> list[FaultReport]:
        """Return all reports since the last call."""
        taken, self._reports = self._reports, []
        self.given = tuple(report for report, given in taken if given)
        return [report for report, _ in taken]
