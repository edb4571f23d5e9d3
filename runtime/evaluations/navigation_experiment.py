"""What a navigation experiment compares: methods, where they drive, and which tables are made of the runs."""

from __future__ import annotations

from collections.abc import Collection, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pydantic import Field, model_validator

from drivers.interface.errors import ConfigurationError
from drivers.interface.settings import Settings
from runtime import yaml_files
from runtime.evaluations.episode import CostSettings
from sim_drivers.scenarios.world_file import world_numbers

Column = Literal[
    "score", "success", "collision", "hit_standing", "timeout", "safety_cost", "min_clearance", "spl", "latency", "duration",
    "path_length", "jerk", "near_goal", "final_distance",
]  # fmt: skip
Metric = Literal["success", "collision_reduction", "relaxed_completion", "min_clearance", "final_distance_reduction"]


class Environment(Settings):
    """Where every method drives with the same seeds: a configuration, or every world of an imported file."""

    configuration: str = Field(min_length=1)
    file: str | None = Field(default=None, description="the key of `files`; its worlds are run one by one")
    overrides: tuple[str, ...] = ()
    seeds: int | None = Field(default=None, ge=1, description="of each world; none: the experiment's")


class TableSettings(Settings):
    """A table: the runs of some methods in some environments, taken together, beside what was published."""

    name: str = Field(min_length=1, description="what `only` calls it")
    title: str
    environments: tuple[str, ...] = Field(min_length=1)
    methods: tuple[str, ...] = Field(min_length=1)
    columns: tuple[Column, ...] = Field(min_length=1)
    published: dict[str, dict[Column, float]] = Field(default_factory=dict, description="figures by method and column")


class PairedSettings(Settings):
    """A paired comparison: what one method gains on another over the same worlds and seeds."""

    name: str = Field(min_length=1, description="what `only` calls it")
    title: str
    environments: tuple[str, ...] = Field(min_length=1)
    method: str
    against: str
    published: dict[Metric, tuple[float, float, float, float]] = Field(
        default_factory=dict, description="mean, low and high end of the interval, p(advantage <= 0)"
    )


class NavigationExperiment(Settings):
    """What is run; `configs/experiments/rcsp.yaml` is the shipped one."""

    title: str
    seeds: int = Field(default=30, ge=1, description="seeds 0 to seeds - 1, the same for every method")
    cost: CostSettings = CostSettings()
    near_goal_m: float = Field(default=0.45, gt=0.0, le=10.0, description="a final pose this near counts as complete")
    relaxed_m: float = Field(default=1.0, gt=0.0, le=10.0, description="a final pose this near is a relaxed completion")
    files: dict[str, Path | None] = Field(default_factory=dict, description="imported worlds; none: those tables are left out")
    environments: dict[str, Environment] = Field(min_length=1)
    methods: dict[str, tuple[str, ...]] = Field(min_length=1, description="overrides a.b=c by the method's name")
    tables: tuple[TableSettings, ...] = Field(min_length=1)
    paired: tuple[PairedSettings, ...] = ()
    only: tuple[str, ...] = Field(default=(), description="tables and paired comparisons that are made; none: all")

    @model_validator(mode="after")
    def _names_exist(self) -> NavigationExperiment:
        _require("file", {e.file for e in self.environments.values() if e.file is not None}, self.files)
        _require("environment", {name for _, environments in self.compared for name in environments}, self.environments)
        _require("method", {name for methods, _ in self.compared for name in methods}, self.methods)
        _require("table", set(self.only), [*(one.name for one in self.tables), *(one.name for one in self.paired)])
        return self

    @property
    def wanted_tables(self) -> tuple[TableSettings, ...]:
        """The tables that are made."""
        return tuple(table for table in self.tables if not self.only or table.name in self.only)

    @property
    def wanted_pairs(self) -> tuple[PairedSettings, ...]:
        """The paired comparisons that are made."""
        return tuple(pair for pair in self.paired if not self.only or pair.name in self.only)

    @property
    def compared(self) -> tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]:
        """Which methods drive in which environments, by table and then by paired comparison."""
        return (
            *((table.methods, table.environments) for table in self.wanted_tables),
            *(((pair.method, pair.against), pair.environments) for pair in self.wanted_pairs),
        )


def _require(kind: str, asked: Set[str], known: Collection[str]) -> None:
    for name in sorted(asked):
        if name not in known:
            raise ValueError(f"there is no {kind} '{name}'. Known: {', '.join(known) or 'none'}")


@dataclass(frozen=True, slots=True, order=True)
class NavigationCase:
    """One run."""

    environment: str
    method: str
    configuration: str  # with the imported world, if it is one
    seed: int
    overrides: tuple[str, ...]
    cost: CostSettings


def read(
    content: yaml_files.Mapping, seeds: int | None, changes: tuple[str, ...]
) -> tuple[NavigationExperiment, tuple[NavigationCase, ...]]:
    """Return the experiment and every run that its tables need, once each, in the order of the tables.

    A change of `files.NAME` is one of the experiment; all others are made in every run.

    Raises:
        ConfigurationError: a file of worlds cannot be read.
        ValidationError: of pydantic.
    """
    parsed = {text: yaml_files.parse_override(text) for text in changes}
    for keys, value in parsed.values():
        if keys[0] == "files":
            content = yaml_files.override(content, keys, value)
    experiment = NavigationExperiment.model_validate(content)
    also = tuple(text for text, (keys, _) in parsed.items() if keys[0] != "files")
    return experiment, _cases(experiment, seeds, also)


def _cases(experiment: NavigationExperiment, seeds: int | None, also: tuple[str, ...]) -> tuple[NavigationCase, ...]:
    found: dict[NavigationCase, None] = {}
    for methods, environments in experiment.compared:
        for name in environments:
            environment = experiment.environments[name]
            for configuration in _configurations(experiment, environment):
                for method in methods:
                    overrides = (*environment.overrides, *experiment.methods[method], *also)
                    for seed in range(seeds or environment.seeds or experiment.seeds):
                        found[NavigationCase(name, method, configuration, seed, overrides, experiment.cost)] = None
    if not found:
        raise ConfigurationError(f"nothing is left to run: set files.NAME, one of {', '.join(experiment.files)}")
    return tuple(found)


def _configurations(experiment: NavigationExperiment, environment: Environment) -> tuple[str, ...]:
    if environment.file is None:
        return (environment.configuration,)
    path = experiment.files[environment.file]
    return () if path is None else tuple(f"{environment.configuration}:{path}#{n}" for n in world_numbers(path))
