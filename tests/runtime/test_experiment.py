"""Experiments: every case once, the same result however many run side by side, and a table that adds up."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.interface.errors import ConfigurationError
from runtime.cli import run_command
from runtime.evaluations import experiment_table
from runtime.evaluations.evaluation import EvaluationTable, load_evaluation
from runtime.evaluations.experiment import Case, Experiment, cases, run_case
from runtime.evaluations.side_by_side import Workers, side_by_side
from runtime.report import RunReport
from runtime.yaml_files import shipped

SHORT = ("mission.time_limit_s=1.5",)
EXPERIMENT = Experiment(
    title="short",
    configurations=("static_corridor", "door"),
    variants={"dwa": ("planner.name=dwa",), "idle": ("planner.name=idle",)},
    seeds=2,
    published_collision_percent={"door": {"dwa": 30.0}},
)


def report(outcome: str, **figures: float) -> RunReport:
    plain = RunReport(
        outcome=outcome,
        planner="dwa",
        scenario="door",
        seed=0,
        ticks=10,
        missed_deadlines=0,
        min_clearance_m=0.1,
        path_length_m=1.0,
        duration_s=10.0,
        odometry_error_m=0.1,
        odometry_error_rad=0.0,
        stage_ms={},
        faults=(),
        realtime_factor=1.0,
        realtime_void=False,
        realtime_refused=(),
        recording=None,
    )
    return replace(plain, **figures)


def test_the_cases_are_all_combinations_in_order() -> None:
    todo = cases(EXPERIMENT, also=SHORT)
    assert [(c.configuration, c.variant, c.seed) for c in todo[:3]] == [
        ("static_corridor", "dwa", 0),
        ("static_corridor", "dwa", 1),
        ("static_corridor", "idle", 0),
    ]
    assert len(todo) == len(set(todo)) == 2 * 2 * 2
    assert todo[0].overrides == ("planner.name=dwa", *SHORT)
    assert len(cases(EXPERIMENT, seeds=5)) == 2 * 2 * 5


def test_side_by_side_gives_what_one_after_the_other_gives() -> None:
    todo = cases(EXPERIMENT, seeds=1, also=SHORT)
    one = side_by_side(todo, run_case, Workers(1))
    two = side_by_side(todo, run_case, Workers(2))
    assert list(one) == list(two) == list(todo)
    for case in todo:
        assert replace(one[case], stage_ms={}, realtime_factor=0.0) == replace(two[case], stage_ms={}, realtime_factor=0.0)


def test_a_row_counts_outcomes_and_averages_what_is_known() -> None:
    case = Case("door", "dwa", 0, ())
    reports = {
        case: report("reached", duration_s=10.0, min_clearance_m=0.2),
        replace(case, seed=1): report("reached", duration_s=20.0, min_clearance_m=0.4),
        replace(case, seed=2): report("collided", duration_s=5.0, min_clearance_m=-0.3, odometry_error_m=0.4),
    }
    (row,) = experiment_table.rows(EXPERIMENT, reports)
    assert row.cells() == ("door", "dwa", "2/3", "1/3", "0/3", "0/3", "30 %", "0.10 m", "15.0 s", "0.20 m, 0.0°")
    table = EvaluationTable(experiment_table.HEAD, (row.cells(),), "").markdown().splitlines()
    assert len({line.count("|") for line in table}) == 1
    assert [run["seed"] for run in json.loads(experiment_table.as_json(reports))] == [0, 0, 0]


def test_without_truth_the_table_stays_empty_there() -> None:
    unknown = report("timed_out", min_clearance_m=None, odometry_error_m=None, odometry_error_rad=None)
    (row,) = experiment_table.rows(EXPERIMENT, {Case("door", "idle", 0, ()): unknown})
    assert row.cells()[6:] == ("", "", "", "")


@pytest.mark.parametrize("name", shipped("experiments"))
def test_shipped_experiments_load(name: str) -> None:
    assert load_evaluation(name, None, ()).steps > 0


def test_a_broken_experiment_names_file_and_key(tmp_path: Path) -> None:
    path = tmp_path / "e.yaml"
    path.write_text("title: t\nconfigurations: [door]\nvariants: {a: []}\nseed: 3\n")
    with pytest.raises(ConfigurationError, match=r"e\.yaml: seed: "):
        load_evaluation(str(path), None, ())


def test_the_command_writes_table_and_reports(tmp_path: Path) -> None:
    experiment = tmp_path / "e.yaml"
    experiment.write_text("title: t\nconfigurations: [door]\nvariants: {idle: [planner.name=idle]}\nseeds: 1\n")
    outputs = ["--json", str(tmp_path / "e.json"), "--markdown", str(tmp_path / "e.md")]
    assert run_command(["evaluate", str(experiment), "--jobs", "1", "--set", SHORT[0], *outputs]) == 0
    assert json.loads((tmp_path / "e.json").read_text())[0]["configuration"] == "door"
    assert "| door | idle | 0/1 |" in (tmp_path / "e.md").read_text()
