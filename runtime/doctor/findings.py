"""What an examination finds, and the report of all of it."""

from __future__ import annotations

import enum
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.table import Table
from rich.text import Text

from runtime.outputs import LOGS

FRESH_S = 3600.0  # a run takes note of an examination that is no older


class Verdict(enum.Enum):
    """What a finding means for motion."""

    GOOD = "good"
    NOTE = "note"  # said for the record
    WARNING = "warning"  # somebody should know
    FORBIDS = "forbids"  # motion must not be allowed


_STYLE = {Verdict.GOOD: "green", Verdict.NOTE: "dim", Verdict.WARNING: "yellow", Verdict.FORBIDS: "bold red"}


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at."""

    subject: str  # a device by its name in the robot, or "machine"
    check: str
    verdict: Verdict
    told: str


@dataclass(frozen=True, slots=True)
class Examination:
    """Everything that was found of one robot and the machine that it is to be run by."""

    robot: str
    configuration: str
    made_at: str  # ISO 8601, UTC
    findings: tuple[Finding, ...]

    @property
    def motion_allowed(self) -> bool:
        """Whether nothing forbids it."""
        return all(finding.verdict is not Verdict.FORBIDS for finding in self.findings)

    def as_json(self) -> str:
        """Return the report as JSON."""
        findings = [asdict(finding) | {"verdict": finding.verdict.value} for finding in self.findings]
        return json.dumps(asdict(self) | {"motion_allowed": self.motion_allowed, "findings": findings}, indent=2) + "\n"

    def table(self) -> Table:
        """Return the report as a table for the terminal."""
        table = Table(title=f"{self.robot}: motion is {'allowed' if self.motion_allowed else 'NOT allowed'}", show_header=False)
        for finding in self.findings:
            verdict = Text(finding.verdict.value, style=_STYLE[finding.verdict])
            table.add_row(finding.subject, finding.check, verdict, Text(finding.told))
        return table


def examination_path(robot: str) -> Path:
    """Return where the newest examination of a robot is kept for its next run."""
    return LOGS / f"doctor-{robot}.json"


def recent_examination(robot: str, now_s: float) -> str:
    """Return the JSON of a robot's newest examination; empty when there is none, or it is older than `FRESH_S`.

    Args:
        robot: name of the robot.
        now_s: the wall clock's time, seconds since the epoch, as files are stamped with.
    """
    path = examination_path(robot)
    try:
        return path.read_text(encoding="utf-8") if now_s - path.stat().st_mtime <= FRESH_S else ""
    except OSError:  # none was made
        return ""
