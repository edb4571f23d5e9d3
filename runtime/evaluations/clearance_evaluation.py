"""`trundle evaluate clearance`: the clearance paper's tables, from runs on our physics, beside the published figures."""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import asdict, dataclass, replace

from pydantic import Field, model_validator

from drivers.interface.errors import unknown_name
from drivers.interface.settings import Settings
from runtime import yaml_files
from runtime.evaluations.clearance_figures import ClearanceFigures, FigureCollector
from runtime.evaluations.clearance_table import COLUMNS, table
from runtime.evaluations.evaluation import Evaluation, EvaluationTable
from runtime.evaluations.side_by_side import Workers, side_by_side
from runtime.referee import Outcome


class Method(Settings):
    """A way to drive."""

    overrides: tuple[str, ...]
    published_as: str = Field(default="", description="what the paper's figures are filed under; empty: the method's own name")


class TableSettings(Settings):
    """Which runs a table is made of."""

    title: str
    scenarios: tuple[str, ...] = Field(min_length=1)
    methods: tuple[str, ...] = Field(min_length=1)
    columns: tuple[str, ...] = Field(min_length=1)
    seeds: int | None = Field(default=None, ge=1, description="fewer than the experiment's, where all are alike")


class ClearanceExperiment(Settings):
    """What is run; `configs/experiments/clearance.yaml` is the shipped one."""

    title: str
    overrides: tuple[str, ...] = Field(default=(), description="of every run, before the method's own")
    methods: dict[str, Method] = Field(min_length=1)
    tables: dict[str, TableSettings] = Field(min_length=1)
    seeds: int = Field(default=10, ge=1, description="seeds 0 to seeds - 1, the same for every method")
    published: dict[str, dict[str, dict[str, float]]] = Field(default_factory=dict, description="by scenario, method, column")
    only: tuple[str, ...] = Field(default=(), description="tables that are made; none: all")

    @model_validator(mode="after")
    def _known(self) -> ClearanceExperiment:
        tables = self.tables.values()
        _require("method", self.methods, [name for one in tables for name in one.methods])
        _require("column", COLUMNS, [name for one in tables for name in one.columns])
        _require("table", self.tables, list(self.only))
        return self


def _require(kind: str, known: Collection[str], names: list[str]) -> None:
    """Raise ValueError for the first of the names that is not known."""
    for name in names:
        if name not in known:
            raise ValueError(str(unknown_name(kind, name, known)))


@dataclass(frozen=True, slots=True, order=True)
class ClearanceCase:
    """One run; tables that ask for the same one share it."""

    scenario: str
    overrides: tuple[str, ...]
    seed: int


class ClearanceEvaluation(Evaluation):
    """Scenarios times methods times seeds, and the tables made of them."""

    def __init__(self, settings: ClearanceExperiment, seeds: int | None, changes: tuple[str, ...]) -> None:
        """Lay out the runs; `changes` are made in every one."""
        self._settings, self._seeds, self._changes = settings, seeds, changes
        wanted = settings.only or tuple(settings.tables)
        self._tables = tuple(settings.tables[name] for name in wanted)
        self._todo = tuple(dict.fromkeys(case for one in self._tables for group in self._groups(one).values() for case in group))
        super().__init__(settings.title, len(self._todo))

    @classmethod
    def from_mapping(cls, content: yaml_files.Mapping, seeds: int | None, changes: tuple[str, ...]) -> ClearanceEvaluation:
        """Read the file's keys; raises pydantic's ValidationError."""
        return cls(ClearanceExperiment.model_validate(content), seeds, changes)

    def run(self, workers: Workers) -> EvaluationTable:
        """Run them all and make the tables, the first with those that follow it."""
        found = side_by_side(self._todo, run_case, workers)
        made = [self._table(one, found) for one in self._tables]
        single = [asdict(case) | asdict(figures) for case, figures in found.items()]
        return replace(made[0], json=json.dumps(single, indent=1), further=tuple(made[1:]))

    def _groups(self, one: TableSettings) -> dict[tuple[str, str], tuple[ClearanceCase, ...]]:
        """Return the runs of each row, by scenario and method."""
        settings = self._settings
        seeds = min(self._seeds or settings.seeds, one.seeds or 10**9)
        return {
            (scenario, method): tuple(
                ClearanceCase(scenario, (*settings.overrides, *settings.methods[method].overrides, *self._changes), seed)
                for seed in range(seeds)
            )
            for scenario in one.scenarios
            for method in one.methods
        }

    def _table(self, one: TableSettings, found: dict[ClearanceCase, ClearanceFigures]) -> EvaluationTable:
        runs = {row: tuple(found[case] for case in group) for row, group in self._groups(one).items()}
        names = {name: method.published_as or name for name, method in self._settings.methods.items()}
        return table(one.title, one.columns, runs, self._settings.published, names)


def run_case(case: ClearanceCase) -> ClearanceFigures:
    """Run one case in this process, without a recording."""
    from runtime import configuration, run  # noqa: PLC0415 - in the worker process, not in the one that hands out the work

    loaded, collector = configuration.load(case.scenario, case.overrides), FigureCollector()
    result = run.run(loaded, run.RunOptions(seed=case.seed, progress=collector.see))
    if result.failure is not None:
        raise result.failure
    if result.report.outcome == Outcome.INTERRUPTED.value:
        raise KeyboardInterrupt  # Ctrl-C means the experiment, not one of its runs
    return collector.figures(result.report, loaded.robot.radius_m)
