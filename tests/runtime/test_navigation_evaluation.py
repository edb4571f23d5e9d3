"""Navigation experiments: every run once, metrics by their definitions, tables that add up, pairs that are pairs."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from drivers.interface.commands import BodyTwist, Command
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal
from drivers.interface.samples import Stamp, TruthSample
from planners.planner import Plan, no_path
from planners.router import Route
from runtime.cli import run_command
from runtime.cycle import Cycle, Verdict
from runtime.evaluations import navigation_experiment, navigation_table
from runtime.evaluations.bootstrap import estimate_mean
from runtime.evaluations.episode import CostSettings, Episode, EpisodeMeter
from runtime.evaluations.evaluation import load_evaluation
from runtime.evaluations.navigation_experiment import NavigationExperiment
from runtime.evaluations.shortest_way import shortest_way_m
from runtime.faults import Response
from runtime.report import StageTime
from runtime.supervisor import STANDING
from sim_drivers.scene import Scene, Shape, StaticObstacle
from tests.runtime.cycles import PERIOD_NS, belief, sensed
from tests.runtime.test_experiment import report

DATA = Path(__file__).parents[1] / "data"
DYNABARN = DATA / "dynabarn/dynabarn_2_worlds.json"
EXPERIMENT = {
    "title": "t",
    "seeds": 3,
    "files": {"worlds": None},
    "environments": {"door": {"configuration": "door"}, "discs": {"configuration": "dynabarn", "file": "worlds", "seeds": 2}},
    "methods": {"a": ["planner.name=dwa"], "b": ["planner.name=idle"], "unused": []},
    "tables": [
        {"name": "one", "title": "one", "environments": ["door"], "methods": ["a", "b"], "columns": ["success", "min_clearance"]},
        {
            "name": "two",
            "title": "two",
            "environments": ["discs"],
            "methods": ["a", "b"],
            "columns": ["score"],
            "published": {"a": {"score": 0.5}},
        },
        {"name": "three", "title": "three", "environments": ["door"], "methods": ["a"], "columns": ["score"]},
    ],
    "paired": [{"name": "four", "title": "four", "environments": ["door", "discs"], "method": "a", "against": "b"}],
}
GOOD = Episode("reached", False, 20.0, 10.0, 0.2, 4.0, 0.9, 1.0, 2.0, 0.3)
BAD = Episode("collided", True, 8.0, 4.0, -0.01, 6.0, 0.0, 1.0, 2.0, 6.0)


def cycle(index: int, sent_m_s: float, clearance_m: float, true_m_s: float, x_m: float) -> Cycle:
    truth = TruthSample(Stamp(index * PERIOD_NS, index * PERIOD_NS, index), SE2(x_m), BodyTwist(true_m_s), (), clearance_m, ())
    command = Command(BodyTwist(sent_m_s), None, 1, 0)
    verdict = Verdict(command, command, Response.RUN, (), STANDING, None)
    return Cycle(sensed(index, truth=truth), belief(index), Route(None, no_path(), 0.0), Plan(BodyTwist()), verdict, ())


def metered(cycles: list[Cycle], shortest_m: float = 4.0, **figures: object) -> Episode:
    meter = EpisodeMeter(CostSettings(near_m=0.2, slow_m_s=0.1), (Goal(0.0, 9.0), Goal(5.0, 3.0)))
    for seen in cycles:
        meter.see(seen)
    stage = StageTime(mean=1.5, p50=1.0, p99=2.0, max=3.0)
    plain = replace(report("reached"), path_length_m=5.0, stage_ms={"plan": stage, "admit": stage, "route": stage})
    return meter.episode(replace(plain, **figures), shortest_m)


def test_an_episode_counts_seconds_that_were_near_or_slow_once() -> None:
    seen = [(0.5, 0.5), (0.1, 0.5), (0.5, 0.05), (0.1, 0.05), (-0.1, 0.5)]  # clearance, speed
    episode = metered([cycle(k, 0.3, clearance, speed, 1.0) for k, (clearance, speed) in enumerate(seen)])
    assert episode.safety_cost_s == pytest.approx(4 * 0.05)
    assert episode.score == pytest.approx(1.0 - 0.03 * 0.2)
    assert episode.final_distance_m == pytest.approx(5.0)  # from the last goal
    assert episode.latency_ms == 3.0


def test_jerk_is_that_of_the_speed_that_was_sent() -> None:
    times = 0.05 * np.arange(40)
    constant_jerk = 0.5 * 1.6 * times**2
    assert metered([cycle(k, v, 1.0, v, 0.0) for k, v in enumerate(constant_jerk)]).jerk_m_s3 == pytest.approx(1.6)
    assert metered([cycle(k, 0.4, 1.0, 0.4, 0.0) for k in range(40)]).jerk_m_s3 == 0.0
    assert metered([cycle(0, 0.4, 1.0, 0.4, 0.0)]).jerk_m_s3 == 0.0


@pytest.mark.parametrize(
    ("outcome", "path_m", "spl", "score"),
    [("reached", 5.0, 0.8, 1.0), ("reached", 3.9, 1.0, 1.0), ("collided", 5.0, 0.0, -1.0), ("timed_out", 5.0, 0.0, -0.1),
     ("stopped", 5.0, 0.0, -0.1)],
)  # fmt: skip
def test_success_is_weighted_by_shortest_way_over_the_one_taken(outcome: str, path_m: float, spl: float, score: float) -> None:
    episode = metered([cycle(0, 0.4, 1.0, 0.4, 0.0)], outcome=outcome, path_length_m=path_m)
    assert episode.spl == pytest.approx(spl)
    assert episode.score == pytest.approx(score)
    assert episode.succeeded + episode.collided + episode.unfinished == 1


def test_the_shortest_way_goes_around_what_stands_and_not_through() -> None:
    wall = StaticObstacle("wall", Shape.box(0.1, 4.0, 1.0), SE2(2.0, 0.0))
    scene = Scene("w", SE2(), (Goal(4.0, 0.0, tolerance_m=0.5),), 60.0, (wall,))
    corner_m, bearing = math.hypot(1.95, 2.0), math.atan2(2.0, 1.95)  # a string around the wall's end, 0.3 m away from it
    string = math.sqrt(corner_m**2 - 0.3**2) + 0.3 * (bearing + math.asin(0.3 / corner_m))
    assert shortest_way_m(scene, 0.3) == pytest.approx(2.0 * string + 0.1 - 0.5, rel=0.015)
    assert shortest_way_m(replace(scene, static=()), 0.3) == pytest.approx(3.5)
    fence = tuple(StaticObstacle(f"f{k}", Shape.cylinder(2.0, 1.0), SE2(4.0 + x, y)) for k, (x, y) in enumerate(RING))
    assert shortest_way_m(replace(scene, static=fence), 0.3) == math.inf
    two = (Goal(1.0, 0.0, tolerance_m=0.25), Goal(1.0, 2.0, tolerance_m=0.5))
    assert shortest_way_m(replace(scene, static=(), goals=two), 0.3) == pytest.approx(0.75 + 1.5)


RING = [(3.0, 0.0), (0.0, 3.0), (-3.0, 0.0), (0.0, -3.0), (2.2, 2.2), (-2.2, 2.2), (2.2, -2.2), (-2.2, -2.2)]


def test_a_mean_of_normal_values_has_the_textbook_interval() -> None:
    values = np.random.default_rng(3).normal(0.5, 1.0, 400)
    found = estimate_mean(values.tolist())
    half = 1.96 * values.std() / math.sqrt(400)
    assert (found.low, found.high) == pytest.approx((values.mean() - half, values.mean() + half), abs=0.01)
    assert found.not_above_zero < 1e-3
    assert estimate_mean((-values).tolist()).not_above_zero > 1.0 - 1e-3
    assert estimate_mean([0.0, 0.0]).not_above_zero == 1.0
    assert estimate_mean(values.tolist()) == found


def test_every_run_is_made_once_and_worlds_without_a_file_are_left_out() -> None:
    _, todo = navigation_experiment.read(EXPERIMENT, None, ("loop.rate_hz=10",))
    assert [(c.environment, c.method, c.seed) for c in todo] == [("door", m, s) for m in "ab" for s in range(3)]
    assert todo[0].overrides == ("planner.name=dwa", "loop.rate_hz=10")
    _, todo = navigation_experiment.read(EXPERIMENT, None, (f"files.worlds={DYNABARN}",))
    assert len(todo) == len(set(todo)) == 6 + 2 * 2 * 2  # two worlds, two seeds each, two methods
    assert {c.configuration for c in todo if c.environment == "discs"} == {f"dynabarn:{DYNABARN}#{n}" for n in (0, 18)}
    _, todo = navigation_experiment.read(EXPERIMENT, 1, (f"files.worlds={DYNABARN}",))
    assert len(todo) == 2 + 2 * 2


def test_only_makes_one_table_and_only_its_runs() -> None:
    experiment, todo = navigation_experiment.read(EXPERIMENT | {"only": ["three"]}, None, ())
    assert {(c.environment, c.method) for c in todo} == {("door", "a")}
    (table,) = navigation_table.tables(experiment, dict.fromkeys(todo, GOOD))
    assert table.title == "three"
    with pytest.raises(ValidationError, match=r"no table 'five'\. Known: one, two, three, four"):
        navigation_experiment.read(EXPERIMENT | {"only": ["five"]}, None, ())


def test_tables_and_pairs_add_up() -> None:
    experiment, todo = navigation_experiment.read(EXPERIMENT, None, ())
    episodes = {case: GOOD if case.method == "a" or case.seed == 0 else BAD for case in todo}
    one, two, three, four = navigation_table.tables(experiment, episodes)
    assert one.rows[0] == ("a", "3 runs", "1.000 [1.000, 1.000]", "0.200 [0.200, 0.200]")
    assert one.rows[1][2].startswith("0.333 [0.000, ")
    assert two.rows == ()  # no worlds were given
    assert three.rows == (("a", "3 runs", "0.880 [0.880, 0.880]"),)
    gains = {row[0]: row for row in four.rows}
    assert gains["success"][1:3] == ("3", "0.667")
    assert gains["collision reduction"][2] == "0.667"
    assert gains["final distance reduction [m]"][2] == f"{2 / 3 * 5.7:.3f}"


def test_the_published_figure_stands_below_ours() -> None:
    experiment, todo = navigation_experiment.read(EXPERIMENT, None, (f"files.worlds={DYNABARN}",))
    two = navigation_table.tables(experiment, dict.fromkeys(todo, GOOD))[1]
    assert [row[:2] for row in two.rows] == [("a", "4 runs"), ("", "paper"), ("b", "4 runs")]
    assert two.rows[1] == ("", "paper", "0.500")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"tables": [EXPERIMENT["tables"][0] | {"methods": ["c"]}]}, "there is no method 'c'. Known: a, b, unused"),
        (
            {"tables": [EXPERIMENT["tables"][0] | {"environments": ["hall"]}]},
            "there is no environment 'hall'. Known: door, discs",
        ),
        ({"environments": {"door": {"configuration": "door", "file": "barn"}}}, "there is no file 'barn'. Known: worlds"),
        ({"tables": [EXPERIMENT["tables"][0] | {"columns": ["luck"]}]}, "Input should be 'score'"),
    ],
)
def test_names_that_nothing_answers_to_are_refused(change: dict, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        NavigationExperiment.model_validate(EXPERIMENT | change)


def test_the_shipped_experiment_runs_720_times_and_more_with_imported_worlds() -> None:
    assert load_evaluation("rcsp", None, ()).steps == 30 * (2 * 8 + 8)
    assert load_evaluation("rcsp", None, (f"files.dynabarn={DYNABARN}",)).steps == 720 + 2 * 5 * (6 + 2)
    with pytest.raises(ConfigurationError, match=r"nowhere\.json cannot be read"):
        load_evaluation("rcsp", None, ("files.barn=nowhere.json",))


def test_nothing_to_run_and_nothing_to_reach_are_said(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"set files\.NAME, one of worlds"):
        navigation_experiment.read(EXPERIMENT | {"tables": EXPERIMENT["tables"][1:2], "paired": []}, None, ())


def test_the_command_writes_every_table(tmp_path: Path) -> None:
    path = tmp_path / "e.yaml"
    path.write_text(json.dumps({"kind": "navigation"} | EXPERIMENT))  # JSON is YAML
    outputs = ["--json", str(tmp_path / "e.json"), "--markdown", str(tmp_path / "e.md")]
    assert run_command(["evaluate", str(path), "--jobs", "1", "--seeds", "1", "--set", "mission.time_limit_s=1", *outputs]) == 0
    found = json.loads((tmp_path / "e.json").read_text())
    assert [(run["method"], run["outcome"]) for run in found["runs"]] == [("a", "timed_out"), ("b", "timed_out")]
    assert found["runs"][0]["safety_cost_s"] > 0.0
    titles = [table["title"] for table in found["tables"]]
    assert titles == ["one", "two: left out, as its file of worlds is not set (--set files.NAME=PATH)", "three", "four"]
    assert "**three**" in (tmp_path / "e.md").read_text()
