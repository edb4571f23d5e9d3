"""The tables of a navigation evaluation: means with their intervals, beside what was published."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from runtime.evaluations.bootstrap import estimate_mean
from runtime.evaluations.episode import Episode
from runtime.evaluations.evaluation import EvaluationTable
from runtime.evaluations.navigation_experiment import (
    Column,
    Metric,
    NavigationCase,
    NavigationExperiment,
    PairedSettings,
    TableSettings,
)

Episodes = dict[NavigationCase, Episode]
PAIRED_HEAD = ("advantage", "pairs", "mean", "95 % interval", "p(advantage <= 0)", "paper")


@dataclass(frozen=True, slots=True)
class _Figure:
    """What a column shows of one run."""

    head: str
    of: Callable[[Episode, NavigationExperiment], float | None]
    digits: int = 3


_FIGURES: dict[Column, _Figure] = {
    "score": _Figure("score", lambda e, _: e.score),
    "success": _Figure("success", lambda e, _: float(e.succeeded)),
    "collision": _Figure("collision", lambda e, _: float(e.collided)),
    "hit_standing": _Figure("of these hit while standing", lambda e, _: float(e.hit_while_standing)),
    "timeout": _Figure("time-out", lambda e, _: float(e.unfinished)),
    "safety_cost": _Figure("safety cost [s]", lambda e, _: e.safety_cost_s, 2),
    "min_clearance": _Figure("min clearance [m]", lambda e, _: e.min_clearance_m),
    "spl": _Figure("SPL", lambda e, _: e.spl),
    "latency": _Figure("latency [ms]", lambda e, _: e.latency_ms, 2),
    "duration": _Figure("duration [s]", lambda e, _: e.duration_s, 1),
    "path_length": _Figure("path length [m]", lambda e, _: e.path_length_m, 2),
    "jerk": _Figure("jerk [m/s^3]", lambda e, _: e.jerk_m_s3, 2),
    "near_goal": _Figure("final pose near", lambda e, x: float(e.final_distance_m <= x.near_goal_m)),
    "final_distance": _Figure("final distance [m]", lambda e, _: e.final_distance_m),
}

_GAINS: dict[Metric, tuple[str, Callable[[Episode, Episode, NavigationExperiment], float]]] = {
    "success": ("success", lambda a, b, _: float(a.succeeded) - float(b.succeeded)),
    "collision_reduction": ("collision reduction", lambda a, b, _: float(b.collided) - float(a.collided)),
    "relaxed_completion": (
        "relaxed completion",
        lambda a, b, x: float(a.final_distance_m <= x.relaxed_m) - float(b.final_distance_m <= x.relaxed_m),
    ),
    "min_clearance": ("min clearance [m]", lambda a, b, _: (a.min_clearance_m or 0.0) - (b.min_clearance_m or 0.0)),
    "final_distance_reduction": ("final distance reduction [m]", lambda a, b, _: b.final_distance_m - a.final_distance_m),
}


def tables(experiment: NavigationExperiment, episodes: Episodes) -> tuple[EvaluationTable, ...]:
    """Return every table and paired comparison; one whose worlds were not given has no rows."""
    return (
        *(_table(experiment, table, episodes) for table in experiment.wanted_tables),
        *(_paired(experiment, paired, episodes) for paired in experiment.wanted_pairs),
    )


def _table(experiment: NavigationExperiment, table: TableSettings, episodes: Episodes) -> EvaluationTable:
    rows: list[tuple[str, ...]] = []
    for method in table.methods:
        group = [e for case, e in episodes.items() if case.method == method and case.environment in table.environments]
        if group:
            cells = (
                _measured([_FIGURES[column].of(e, experiment) for e in group], _FIGURES[column].digits)
                for column in table.columns
            )
            rows.append((method, f"{len(group)} runs", *cells))
            rows += _published(table, method)
    head = ("method", "from", *(_FIGURES[column].head for column in table.columns))
    return EvaluationTable(head, tuple(rows), "", _titled(table.title, rows))


def _measured(values: list[float | None], digits: int) -> str:
    known = [value for value in values if value is not None]
    if not known:
        return ""
    found = estimate_mean(known)
    return f"{found.mean:.{digits}f} [{found.low:.{digits}f}, {found.high:.{digits}f}]"


def _published(table: TableSettings, method: str) -> list[tuple[str, ...]]:
    figures = table.published.get(method)
    if figures is None:
        return []
    cells = (f"{figures[column]:.3f}" if column in figures else "" for column in table.columns)
    return [("", "paper", *cells)]


def _paired(experiment: NavigationExperiment, paired: PairedSettings, episodes: Episodes) -> EvaluationTable:
    one, other = (
        {
            (case.configuration, case.environment, case.seed): episode
            for case, episode in episodes.items()
            if case.method == method
        }
        for method in (paired.method, paired.against)
    )
    pairs = [(one[place], other[place]) for place in one if place[1] in paired.environments]
    rows: list[tuple[str, ...]] = []
    for metric, (name, gain) in _GAINS.items() if pairs else ():
        found = estimate_mean([gain(a, b, experiment) for a, b in pairs])
        figures = (f"{found.mean:.3f}", f"[{found.low:.3f}, {found.high:.3f}]", f"{found.not_above_zero:.3f}")
        rows.append((name, str(len(pairs)), *figures, _published_gain(paired, metric)))
    return EvaluationTable(PAIRED_HEAD, tuple(rows), "", _titled(paired.title, rows))


def _titled(title: str, rows: list[tuple[str, ...]]) -> str:
    return title if rows else f"{title}: left out, as its file of worlds is not set (--set files.NAME=PATH)"


def _published_gain(paired: PairedSettings, metric: Metric) -> str:
    if metric not in paired.published:
        return ""
    mean, low, high, p = paired.published[metric]
    return f"{mean:.3f} [{low:.3f}, {high:.3f}], p = {p:.3f}"
