"""The table of an experiment: how runs ended and what they cost, per configuration and variant, beside what was published."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from statistics import fmean

from runtime.evaluations.experiment import Case, Experiment
from runtime.report import RunReport

HEAD = (
    "scenario",
    "variant",
    "reached",
    "collided",
    "timed out",
    "stopped",
    "published collisions",
    "least clearance",
    "time",
    "odometry error",
)


@dataclass(frozen=True, slots=True)
class Row:
    """One configuration with one variant, over all seeds."""

    configuration: str
    variant: str
    runs: int
    outcomes: Counter[str]
    published_percent: float | None
    mean_min_clearance_m: float | None
    mean_time_to_goal_s: float | None  # over the runs that reached it
    mean_odometry_error: tuple[float, float] | None  # of the final pose: m, rad

    def cells(self) -> tuple[str, ...]:
        """Return the texts of the table's cells, in the order of HEAD."""
        counts = [f"{self.outcomes[name]}/{self.runs}" for name in ("reached", "collided", "timed_out", "stopped")]
        published = "" if self.published_percent is None else f"{self.published_percent:g} %"
        clearance = "" if self.mean_min_clearance_m is None else f"{self.mean_min_clearance_m:.2f} m"
        duration = "" if self.mean_time_to_goal_s is None else f"{self.mean_time_to_goal_s:.1f} s"
        return (self.configuration, self.variant, *counts, published, clearance, duration, self._odometry())

    def _odometry(self) -> str:
        if self.mean_odometry_error is None:
            return ""
        metres, radians = self.mean_odometry_error
        return f"{metres:.2f} m, {math.degrees(radians):.1f}°"


def rows(experiment: Experiment, reports: dict[Case, RunReport]) -> tuple[Row, ...]:
    """Return one row per configuration and variant, in the experiment's order."""
    grouped: dict[tuple[str, str], list[RunReport]] = {}
    for case, report in reports.items():
        grouped.setdefault((case.configuration, case.variant), []).append(report)
    return tuple(_row(experiment, configuration, variant, group) for (configuration, variant), group in grouped.items())


def as_json(reports: dict[Case, RunReport]) -> str:
    """Return every run's report as JSON."""
    runs = [{"configuration": case.configuration, "variant": case.variant} | asdict(report) for case, report in reports.items()]
    return json.dumps(runs, indent=1)


def _row(experiment: Experiment, configuration: str, variant: str, group: list[RunReport]) -> Row:
    metres, radians = _mean(r.odometry_error_m for r in group), _mean(r.odometry_error_rad for r in group)
    return Row(
        configuration,
        variant,
        len(group),
        Counter(report.outcome for report in group),
        experiment.published_collision_percent.get(configuration, {}).get(variant),
        _mean(report.min_clearance_m for report in group),
        _mean(report.duration_s for report in group if report.outcome == "reached"),
        None if metres is None or radians is None else (metres, radians),
    )


def _mean(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return fmean(known) if known else None
