"""Where a part of the runtime that caught a failure leaves word for the supervisor."""

from runtime.faults import FaultReport


class FaultBoard:
    """Reports of this tick, taken down by the supervisor."""

    def __init__(self) -> None:
        """Start empty."""
        self._reports: list[FaultReport] = []

    def post(self, report: FaultReport) -> None:
        """Leave a report."""
        self._reports.append(report)

    def take(self) -> list[FaultReport]:
        """Return all reports since the last call."""
        reports, self._reports = self._reports, []
        return reports
