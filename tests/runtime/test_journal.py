"""Kept results: what was done is not done again, what was cut is, and results of something else are refused."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

import pytest

from drivers.interface.errors import ConfigurationError
from runtime.cli import run_command
from runtime.evaluations.episode import CostSettings, Episode
from runtime.evaluations.journal import Journal
from runtime.evaluations.navigation_experiment import NavigationCase
from runtime.evaluations.side_by_side import Workers, side_by_side

CASES = tuple(NavigationCase("door", "dwa", "door", seed, ("a.b=1",), CostSettings()) for seed in range(3))
done_seeds: list[int] = []


@dataclass(frozen=True, slots=True)
class Other:
    length_m: tuple[float, ...]


def drive(case: NavigationCase) -> Episode:
    done_seeds.append(case.seed)
    return Episode("reached", False, 0.1 + case.seed, 1 / 3, None, math.inf, 0.9, 1.0, 2.0, 0.3)


def measure(case: NavigationCase) -> Other:
    return Other((case.seed / 7.0, 1.0))


def test_an_interrupted_evaluation_goes_on_where_it_was(tmp_path: Path) -> None:
    path, steps = tmp_path / "kept.jsonl", []
    done_seeds.clear()
    whole = side_by_side(CASES[:2], drive, Workers(1, lambda: steps.append(1), Journal(path, "x at 1")))
    with path.open("a", encoding="utf-8") as file:
        file.write('{"case": {"environment": "door", "met')  # killed while writing
    again = side_by_side(CASES, drive, Workers(1, lambda: steps.append(1), Journal(path, "x at 1")))
    assert done_seeds == [0, 1, 2]
    assert len(steps) == 2 + 3
    assert list(again) == list(CASES)
    assert {case: again[case] for case in CASES[:2]} == whole
    assert again[CASES[2]] == side_by_side(CASES, drive, Workers(1, journal=Journal(path, "x at 1")))[CASES[2]]
    assert done_seeds == [0, 1, 2]


def test_nested_results_come_back_exactly(tmp_path: Path) -> None:
    path = tmp_path / "kept.jsonl"
    first = side_by_side(CASES, measure, Workers(1, journal=Journal(path, "x")))
    assert Journal(path, "x").known(CASES, measure) == first


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('{"of": "x at 2"}\n', "is of x at 2, not of x at 1"),
        ("[1]\n", "is no journal"),
        ("drive", "is no journal"),
        ('{"of": "x at 1"', "is no journal"),
        ('{"of": "x at 1"}\n{"case": 1}\n', "is no journal"),
    ],
)
def test_results_of_something_else_are_refused_and_kept(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "kept.jsonl"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=sentence):
        Journal(path, "x at 1")
    assert path.read_text() == text


def test_a_result_of_another_kind_names_its_field(tmp_path: Path) -> None:
    path = tmp_path / "kept.jsonl"
    side_by_side(CASES, measure, Workers(1, journal=Journal(path, "x")))
    with pytest.raises(ConfigurationError, match="outcome"):
        side_by_side(CASES, drive, Workers(1, journal=Journal(path, "x")))


def test_the_command_keeps_what_it_did(tmp_path: Path) -> None:
    experiment, kept = tmp_path / "e.yaml", tmp_path / "kept.jsonl"
    experiment.write_text("title: t\nconfigurations: [door]\nvariants: {idle: [planner.name=idle]}\nseeds: 1\n")
    command = ["evaluate", str(experiment), "--jobs", "1", "--set", "mission.time_limit_s=0.2", "--journal", str(kept)]
    assert run_command(command) == 0
    owner, run = (json.loads(line) for line in kept.read_text().splitlines())
    assert owner["of"].startswith("'t' at ")
    assert run["case"]["configuration"] == "door"
    assert run["result"]["outcome"] == "timed_out"


def test_changed_code_does_not_go_on_from_results_it_may_not_have_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("runtime.log.header.code_version", lambda: ("v1", True))
    experiment, kept = tmp_path / "e.yaml", tmp_path / "kept.jsonl"
    experiment.write_text("title: t\nconfigurations: [door]\nvariants: {idle: [planner.name=idle]}\nseeds: 1\n")
    kept.write_text('{"of": "\'t\' at v1"}\n')
    assert run_command(["evaluate", str(experiment), "--jobs", "1", "--journal", str(kept)]) == 2
    assert "this code has changes" in " ".join(capsys.readouterr().err.split())
    assert kept.read_text() == '{"of": "\'t\' at v1"}\n'
