"""What `trundle evaluate` runs: an experiment file's `kind` names which evaluation it describes; its own keys are that kind's."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from pydantic import ValidationError

from drivers.interface.errors import ConfigurationError, unknown_name
from runtime import yaml_files
from runtime.evaluations.side_by_side import Workers


@dataclass(frozen=True, slots=True)
class EvaluationTable:
    """What an evaluation found, for the eye and for other programs."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    json: str  # every single result
    title: str = ""  # of one table of several; empty: the evaluation's own
    further: tuple[EvaluationTable, ...] = ()  # that follow this one; their results are in its JSON

    def markdown(self) -> str:
        """Return the tables as Markdown."""
        lines = [f"**{self.title}**", ""] if self.title else []
        lines += [f"| {' | '.join(self.head)} |", "|" + "---|" * len(self.head)]
        lines += [f"| {' | '.join(row)} |" for row in self.rows]
        return "\n".join(("\n".join(lines) + "\n", *(one.markdown() for one in self.further)))


class Evaluation(ABC):
    """An experiment that has been read, with what the command line adds to it."""

    def __init__(self, title: str, steps: int) -> None:
        """Take what stands over the table, and how many times `run` will say that something is done."""
        self.title, self.steps = title, steps

    @classmethod
    @abstractmethod
    def from_mapping(cls, content: yaml_files.Mapping, seeds: int | None, changes: tuple[str, ...]) -> Evaluation:
        """Read the file's keys (`kind` taken out), with changes for every run; raises pydantic's ValidationError."""

    @abstractmethod
    def run(self, workers: Workers) -> EvaluationTable:
        """Do everything."""


def load_evaluation(name_or_path: str, seeds: int | None, changes: tuple[str, ...], only: tuple[str, ...] = ()) -> Evaluation:
    """Read an experiment by path or shipped name; without a `kind` it is one of `runs`.

    `only` takes the place of the key of that name, which kinds of several tables have.

    Raises:
        ConfigurationError: with file and key.
    """
    from runtime.evaluations.clearance_evaluation import ClearanceEvaluation  # noqa: PLC0415 - each kind knows this contract
    from runtime.evaluations.experiment import RunsEvaluation  # noqa: PLC0415
    from runtime.evaluations.navigation_evaluation import NavigationEvaluation  # noqa: PLC0415
    from runtime.evaluations.odometry_evaluation import OdometryEvaluation  # noqa: PLC0415
    from runtime.evaluations.perception_evaluation import PerceptionEvaluation  # noqa: PLC0415
    from runtime.evaluations.registration_evaluation import RegistrationEvaluation  # noqa: PLC0415

    kinds: dict[str, type[Evaluation]] = {
        "runs": RunsEvaluation,
        "navigation": NavigationEvaluation,
        "clearance": ClearanceEvaluation,
        "odometry": OdometryEvaluation,
        "perception": PerceptionEvaluation,
        "registration": RegistrationEvaluation,
    }
    path = yaml_files.find(name_or_path, "experiments")
    content = yaml_files.read(path, "experiments")
    chosen = str(content.pop("kind", "runs"))
    if only:
        content["only"] = list(only)
    if chosen not in kinds:
        raise ConfigurationError(f"{path}: kind: {unknown_name('kind of experiment', chosen, kinds)}")
    try:
        return kinds[chosen].from_mapping(content, seeds, changes)
    except ValidationError as error:
        first = error.errors()[0]
        raise ConfigurationError(f"{path}: {'.'.join(map(str, first['loc']))}: {first['msg']}") from error
