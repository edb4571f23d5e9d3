"""`trundle evaluate rcsp`: methods that drive through the same worlds with the same seeds, as a paper's tables."""

from __future__ import annotations

import json
import math
from dataclasses import asdict

from drivers.interface.errors import ConfigurationError
from runtime import yaml_files
from runtime.evaluations import navigation_experiment
from runtime.evaluations.episode import Episode
from runtime.evaluations.evaluation import Evaluation, EvaluationTable
from runtime.evaluations.navigation_experiment import NavigationCase, NavigationExperiment
from runtime.evaluations.side_by_side import Workers, side_by_side


class NavigationEvaluation(Evaluation):
    """Every run that the tables need, once; then the tables."""

    def __init__(self, experiment: NavigationExperiment, todo: tuple[NavigationCase, ...]) -> None:
        """Take what is to be run."""
        self._experiment, self._todo = experiment, todo
        super().__init__(experiment.title, len(self._todo))

    @classmethod
    def from_mapping(cls, content: yaml_files.Mapping, seeds: int | None, changes: tuple[str, ...]) -> NavigationEvaluation:
        """Read the file's keys; `--set files.NAME=PATH` names imported worlds.

        Raises:
            ConfigurationError: a file of worlds cannot be read.
            ValidationError: of pydantic.
        """
        return cls(*navigation_experiment.read(content, seeds, changes))

    def run(self, workers: Workers) -> EvaluationTable:
        """Run them all."""
        from runtime.evaluations import navigation_table  # noqa: PLC0415 - SciPy's statistics are not needed to read an experiment

        episodes = side_by_side(self._todo, drive, workers)
        first, *further = navigation_table.tables(self._experiment, episodes)
        return EvaluationTable(first.head, first.rows, _as_json(episodes, (first, *further)), first.title, tuple(further))


def drive(case: NavigationCase) -> Episode:
    """Run one case in this process, without a recording.

    Raises:
        ConfigurationError: there is nothing to reach, or no way to it.
    """
    from runtime import configuration, run  # noqa: PLC0415 - in the worker process, not in the one that hands out the work
    from runtime.assembly import draw_scene  # noqa: PLC0415
    from runtime.evaluations.episode import EpisodeMeter  # noqa: PLC0415
    from runtime.evaluations.experiment import report_of  # noqa: PLC0415
    from runtime.evaluations.shortest_way import shortest_way_m  # noqa: PLC0415

    loaded = configuration.load(case.configuration, case.overrides)
    scene = draw_scene(loaded, case.seed)
    shortest_m = 0.0 if scene is None else shortest_way_m(scene, loaded.robot.radius_m)
    if scene is None or not 0.0 < shortest_m < math.inf:
        raise ConfigurationError(
            f"{case.configuration}, seed {case.seed}: there is no way to a goal that a run could be judged by"
        )
    meter = EpisodeMeter(case.cost, scene.goals)
    report = report_of(run.run(loaded, run.RunOptions(seed=case.seed, progress=meter.see)))
    return meter.episode(report, shortest_m)


def _as_json(episodes: dict[NavigationCase, Episode], tables: tuple[EvaluationTable, ...]) -> str:
    keys = ("environment", "method", "configuration", "seed")
    runs = [{key: getattr(case, key) for key in keys} | asdict(episode) for case, episode in episodes.items()]
    shown = [{"title": table.title, "head": table.head, "rows": table.rows} for table in tables]
    return json.dumps({"runs": runs, "tables": shown}, indent=1)
