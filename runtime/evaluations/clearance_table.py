"""The clearance paper's tables over runs of ours: one row a scenario and method, each figure with the published one beside it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import beta

from runtime.evaluations.clearance_figures import ClearanceFigures
from runtime.evaluations.evaluation import EvaluationTable

Published = Mapping[str, Mapping[str, Mapping[str, float]]]  # by scenario, method and column


@dataclass(frozen=True, slots=True)
class Column:
    """A figure of a table."""

    head: str
    value: Callable[[ClearanceFigures], float | None]  # of one run
    text: str = "{:.3f}"
    spread: bool = False  # the standard deviation over the seeds is said, too


def _percent(outcome: str) -> Callable[[ClearanceFigures], float]:
    return lambda run: 100.0 * (run.outcome == outcome)


def _fallback(category: str) -> Callable[[ClearanceFigures], float | None]:
    return lambda run: None if run.fallbacks is None else 100.0 * run.fallbacks[category]


def _property(name: str) -> Callable[[ClearanceFigures], float | None]:
    return lambda run: None if run.properties is None else 100.0 * run.properties[name]


def _tracking(run: ClearanceFigures) -> float | None:
    return None if run.tracking is None else 100.0 * run.tracking


COLUMNS = {
    "collided": Column("collided [%]", _percent("collided"), "{:.0f}"),
    "reached": Column("reached [%]", _percent("reached"), "{:.0f}"),
    "time": Column("time to goal [s]", lambda run: run.duration_s if run.outcome == "reached" else None, "{:.1f}"),
    "centre": Column("least clearance, centre [m]", lambda run: run.centre_m, spread=True),
    "surface": Column("surface [m]", lambda run: run.surface_m, spread=True),
    "jerk": Column("jerk RMS [m/s3]", lambda run: run.jerk_rms_m_s3, "{:.2f}", spread=True),
    "tracking": Column("M1 tracking [%]", _tracking, "{:.1f}", spread=True),
    "task_reset": Column("task reset [%]", _fallback("task_reset"), "{:.1f}", spread=True),
    "sensing_failure": Column("sensing failure [%]", _fallback("sensing_failure"), "{:.1f}", spread=True),
    "regular": Column("regular failure [%]", _fallback("regular_continuation_failure"), "{:.1f}", spread=True),
    "deviation": Column("deviation, mean [m]", lambda run: run.deviation_mean_m, "{:.4f}", spread=True),
    "deviation_p95": Column("p95 [m]", lambda run: run.deviation_p95_m, spread=True),
    "plan": Column("plan, mean [ms]", lambda run: run.plan_mean_ms, "{:.2f}"),
    "plan_p99": Column("p99 [ms]", lambda run: run.plan_p99_ms, "{:.2f}"),
    "estimate": Column("estimate, mean [ms]", lambda run: run.estimate_mean_ms, "{:.2f}"),
    "estimate_p99": Column("p99 [ms]", lambda run: run.estimate_p99_ms, "{:.2f}"),
    "admit": Column("admit, mean [ms]", lambda run: run.admit_mean_ms, "{:.2f}"),
    "admit_p99": Column("p99 [ms]", lambda run: run.admit_p99_ms, "{:.2f}"),
} | {name: Column(f"{name.upper()} [%]", _property(name), "{:.0f}") for name in ("p1", "p2", "p3", "p4", "p5", "p6")}


def table(
    title: str,
    columns: tuple[str, ...],
    runs: Mapping[tuple[str, str], tuple[ClearanceFigures, ...]],
    published: Published,
    names: Mapping[str, str],
) -> EvaluationTable:
    """Return a table.

    Args:
        title: what stands over it.
        columns: keys of COLUMNS.
        runs: of every scenario and method, over the seeds.
        published: what the paper has, in parentheses behind ours.
        names: what the paper calls a method.
    """
    rows = [
        (
            scenario,
            method,
            str(len(group)),
            *(_cell(COLUMNS[c], c, group, _paper(published, scenario, names[method])) for c in columns),
        )
        for (scenario, method), group in runs.items()
    ]
    return EvaluationTable(("scenario", "method", "runs", *(COLUMNS[c].head for c in columns)), tuple(rows), "", title=title)


def upper_bound_percent(events: int, runs: int, confidence: float = 0.95) -> float:
    """Return the upper end of the one-sided Clopper-Pearson interval for a rate [%].

    >>> round(upper_bound_percent(0, 100), 2)
    2.95
    """
    return 100.0 if events == runs else 100.0 * float(beta.ppf(confidence, events + 1, runs - events))


def _paper(published: Published, scenario: str, method: str) -> Mapping[str, float]:
    return published.get(scenario, {}).get(method, {})


def _cell(column: Column, key: str, group: tuple[ClearanceFigures, ...], paper: Mapping[str, float]) -> str:
    values = [value for run in group if (value := column.value(run)) is not None and math.isfinite(value)]
    ours = ""
    if values:
        ours = column.text.format(float(np.mean(values)))
        if column.spread and len(values) > 1:
            ours += " ± " + column.text.format(float(np.std(values)))
        if key == "collided" and len(group) >= 30:
            ours += f" (at most {upper_bound_percent(sum(v > 0 for v in values), len(group)):.1f} with 95 % confidence)"
    return f"{ours} [{paper[key]:g}]" if key in paper else ours
