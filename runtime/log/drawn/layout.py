"""The layout that is embedded in every recording: two tabs, one for each question that a log is opened with."""

from __future__ import annotations

import enum

import rerun.blueprint as rrb

from runtime.log.drawn import what_happened, why_late
from runtime.log.header import RunHeader


class Question(enum.Enum):
    """What a log is opened to find out."""

    HAPPENED = "happened"
    LATE = "late"

    @property
    def tab(self) -> str:
        """The name of its tab."""
        return {Question.HAPPENED: what_happened.NAME, Question.LATE: why_late.NAME}[self]


def layout(header: RunHeader) -> rrb.Blueprint:
    """Return the layout; the viewer opens it at the first tab."""
    return rrb.Blueprint(
        rrb.Tabs(what_happened.layout(header), why_late.layout(), active_tab=0),
        rrb.TimePanel(timeline="mono", state="collapsed"),
        collapse_panels=True,
    )
