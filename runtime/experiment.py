"""An experiment: configurations times variants times seeds, run side by side in processes of their own."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context

from pydantic import Field, ValidationError

from drivers.interface.errors import ConfigurationError
from drivers.interface.settings import Settings
from runtime import yaml_files
from runtime.referee import Outcome
from runtime.report import RunReport


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


def load_experiment(name_or_path: str) -> Experiment:
    """Load an experiment by path or shipped name.  Raises ConfigurationError with file and key."""
    path = yaml_files.find(name_or_path, "experiments")
    try:
        return Experiment.model_validate(yaml_files.read(path, "experiments"))
    except ValidationError as error:
        first = error.errors()[0]
        raise ConfigurationError(f"{path}: {'.'.join(map(str, first['loc']))}: {first['msg']}") from error


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

    result = run.run(configuration.load(case.configuration, case.overrides), run.RunOptions(seed=case.seed))
    if result.failure is not None:
        raise result.failure
    if result.report.outcome == Outcome.INTERRUPTED.value:
        raise KeyboardInterrupt  # Ctrl-C means the experiment, not one of its runs
    return result.report


def run_all(todo: tuple[Case, ...], jobs: int, done: Callable[[Case, RunReport], None]) -> dict[Case, RunReport]:
    """Run all cases, `jobs` at a time; `done` hears of each as it ends.  The result does not depend on which came first."""
    reports: dict[Case, RunReport] = {}
    for case, report in _each(todo, jobs):
        reports[case] = report
        done(case, report)
    return {case: reports[case] for case in todo}


def _each(todo: tuple[Case, ...], jobs: int) -> Iterator[tuple[Case, RunReport]]:
    if jobs == 1:
        yield from ((case, run_case(case)) for case in todo)
        return
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # one core a process: more threads would only push each other aside
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        futures = {pool.submit(run_case, case): case for case in todo}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
