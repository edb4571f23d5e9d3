"""An experiment: configurations times variants times seeds, run side by side in processes of their own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pydantic import Field

from drivers.interface.settings import Settings
from runtime import yaml_files
from runtime.evaluations.evaluation import Evaluation, EvaluationTable
from runtime.evaluations.side_by_side import Workers, side_by_side
from runtime.referee import Outcome
from runtime.report import RunReport

if TYPE_CHECKING:
    from runtime.run import RunResult


class Experiment(Settings):
    """What is run; `configs/experiments` holds the shipped ones."""

    title: str
    configurations: tuple[str, ...] = Field(min_length=1)
    variants: dict[str, tuple[str, ...]] = Field(min_length=1, description="overrides a.b=c by the variant's name")
    seeds: int = Field(default=10, ge=1, description="seeds 0 to seeds - 1, the same for every variant")
    published_collision_percent: dict[str, dict[str, float]] = Field(default_factory=dict)


@dataclass(frozen=True, slots=True, order=True)
class Case:
    """One run of an experiment."""

    configuration: str
    variant: str
    seed: int
    overrides: tuple[str, ...]


def cases(experiment: Experiment, seeds: int | None = None, also: tuple[str, ...] = ()) -> tuple[Case, ...]:
    """Return every run of the experiment, in its own order."""
    return tuple(
        Case(configuration, variant, seed, (*overrides, *also))
        for configuration in experiment.configurations
        for variant, overrides in experiment.variants.items()
        for seed in range(seeds or experiment.seeds)
    )


def run_case(case: Case) -> RunReport:
    """Run one case in this process, without a recording."""
    from runtime import configuration, run  # noqa: PLC0415 - in the worker process, not in the one that hands out the work

    return report_of(run.run(configuration.load(case.configuration, case.overrides), run.RunOptions(seed=case.seed)))


def report_of(result: RunResult) -> RunReport:
    """Return the report of one run of many; what broke the run is raised, and Ctrl-C means all of them."""
    if result.failure is not None:
        raise result.failure
    if result.report.outcome == Outcome.INTERRUPTED.value:
        raise KeyboardInterrupt
    return result.report


class RunsEvaluation(Evaluation):
    """Configurations times variants times seeds, and how the runs ended."""

    def __init__(self, settings: Experiment, seeds: int | None, changes: tuple[str, ...]) -> None:
        """Lay out the runs; `changes` are made in every one."""
        self._experiment, self._todo = settings, cases(settings, seeds, changes)
        super().__init__(settings.title, len(self._todo))

    @classmethod
    def from_mapping(cls, content: yaml_files.Mapping, seeds: int | None, changes: tuple[str, ...]) -> RunsEvaluation:
        """Read the file's keys; raises pydantic's ValidationError."""
        return cls(Experiment.model_validate(content), seeds, changes)

    def run(self, workers: Workers) -> EvaluationTable:
        """Run them all."""
        from runtime.evaluations import experiment_table  # noqa: PLC0415 - it knows this module

        reports = side_by_side(self._todo, run_case, workers)
        rows = experiment_table.rows(self._experiment, reports)
        return EvaluationTable(experiment_table.HEAD, tuple(row.cells() for row in rows), experiment_table.as_json(reports))
