"""`trundle evaluate clearance` from its file to its tables, and the figures of a run against closed forms."""

import json
import math

import numpy as np
import pytest

from drivers.interface.errors import ConfigurationError
from runtime import configuration, yaml_files
from runtime.cli import run_command
from runtime.evaluations.clearance_evaluation import ClearanceEvaluation, ClearanceExperiment
from runtime.evaluations.clearance_figures import jerk_rms
from runtime.evaluations.evaluation import load_evaluation

SMALL = """
kind: clearance
title: small
overrides: [mission.time_limit_s=1.5]
methods:
  manifold: {overrides: [planner.name=clearance_manifold], published_as: ours}
  attractor: {overrides: [planner.name=point_ds]}
tables:
  first: {title: First, scenarios: [static_corridor], methods: [manifold, attractor], columns: [collided, tracking, jerk, p6]}
  second: {title: Second, scenarios: [static_corridor], methods: [manifold], columns: [surface, centre, deviation, plan]}
seeds: 1
published:
  static_corridor: {ours: {collided: 12.5}}
"""


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(SMALL)
    return path


def test_tables_share_runs_and_say_what_was_published(small, tmp_path):
    out, table = tmp_path / "out.json", tmp_path / "out.md"
    assert run_command(["evaluate", str(small), "--jobs", "1", "--json", str(out), "--markdown", str(table)]) == 0
    runs = json.loads(out.read_text())
    assert [run["overrides"][-1] for run in runs] == ["planner.name=clearance_manifold", "planner.name=point_ds"]
    manifold, attractor = runs
    assert manifold["outcome"] == "timed_out"
    assert manifold["centre_m"] - manifold["surface_m"] == pytest.approx(0.12)
    assert 0.8 < manifold["tracking"] <= 1.0
    assert manifold["properties"]["p6"] == 1.0
    assert attractor["tracking"] is None
    text = table.read_text()
    assert text.index("**First**") < text.index("**Second**")
    assert "| static_corridor | manifold | 1 | 0 [12.5] |" in text
    assert "| static_corridor | attractor | 1 | 0 |  |" in text


def test_only_makes_one_table_and_only_its_runs(small):
    assert load_evaluation(str(small), None, ()).steps == 2
    assert load_evaluation(str(small), 3, (), ("second",)).steps == 3


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("methods: [manifold]", "methods: [manifolt]"), "manifolt"),
        (("columns: [surface", "columns: [surfaces"), "surfaces"),
        (("seeds: 1", "only: [third]"), "third"),
    ],
)
def test_an_unknown_name_is_told(small, change, sentence):
    small.write_text(SMALL.replace(*change))
    with pytest.raises(ConfigurationError, match=sentence):
        load_evaluation(str(small), None, ())


def test_a_kind_with_one_table_refuses_to_choose(tmp_path):
    path = tmp_path / "runs.yaml"
    path.write_text("title: t\nconfigurations: [door]\nvariants: {a: []}\n")
    with pytest.raises(ConfigurationError, match="only"):
        load_evaluation(str(path), None, (), ("first",))


def test_the_shipped_experiment_holds_every_scenario_of_the_paper_with_ten_paired_seeds():
    evaluation = load_evaluation("clearance", None, ())
    assert isinstance(evaluation, ClearanceEvaluation)
    assert load_evaluation("clearance", None, (), ("table_1",)).steps == 6 * 2 * 10


def test_every_method_of_the_shipped_experiment_is_a_configuration_of_what_its_name_says():
    settings = ClearanceExperiment.model_validate(
        {k: v for k, v in yaml_files.read(yaml_files.find("clearance", "experiments"), "experiments").items() if k != "kind"}
    )
    loaded = {
        name: configuration.load("dynamic_hallway", (*settings.overrides, *method.overrides))
        for name, method in settings.methods.items()
    }
    shields = {name: one.shield.settings for name, one in loaded.items()}
    assert loaded["ours, 5 Hz, 120 deg"].loop.rate_hz == 5.0
    assert shields["ours, objects"].form == "objects"
    assert shields["point-DS, single scalar"].form == "single_scalar"
    assert shields["ours, boundaries, no gate"].gate == "none"
    assert shields["ours, gate by field rate"].gate == "field_rate"
    assert shields["ours, material derivative"].buffer_max_m is None
    assert shields["one boundary sample"].directions == 1
    assert not loaded["no continuation"].planner.choice.settings.tracker.enabled


def test_jerk_of_an_oscillation_is_the_closed_form():
    step_s, omega, amplitude = 0.2, 1.3, 0.4
    t = step_s * np.arange(4000)
    velocity = np.stack((amplitude * np.sin(omega * t), amplitude * np.cos(omega * t)), axis=1)
    expected = amplitude * (2.0 - 2.0 * math.cos(omega * step_s)) / step_s**2
    assert jerk_rms(velocity, step_s) == pytest.approx(expected, rel=1e-6)
    assert jerk_rms(velocity[:2], step_s) == 0.0
