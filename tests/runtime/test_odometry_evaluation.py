"""`trundle evaluate odometry`, on a small square and on the recorded drive."""

import json
from pathlib import Path

import pytest

from drivers.interface.errors import ConfigurationError
from runtime.cli import run_command
from runtime.evaluations.evaluation import load_evaluation
from runtime.evaluations.recorded_odometry import read_points, score_recording

DATA = Path(__file__).parents[1] / "data" / "diff_drive"
WHEELS, TRUTH = DATA / "input_excerpt.txt", DATA / "ground_truth_excerpt.txt"
SQUARE = """
kind: odometry
title: small
configuration: square
overrides: ["robot.camera=null", "world.margin_m=6", "loop.rate_hz=10", "robot.base.wheel_radius_error=[0.03, -0.03, 0.03]"]
side_m: 1.0
seeds: 1
"""


def test_the_recorded_drive_is_scored_on_the_half_that_was_not_fitted():
    first, second = score_recording(WHEELS, TRUTH)
    for score in (first, second):
        assert 3.0 < score.way_m < 5.0
        for error in (score.nominal, score.fitted):
            assert 0.01 < error.absolute_m < 0.035
            assert error.relative_m < 0.015
        assert score.fitted.relative_m < score.nominal.relative_m


def test_calibration_makes_a_square_better(tmp_path, capsys):
    (tmp_path / "small.yaml").write_text(SQUARE)
    out = tmp_path / "out.json"
    assert run_command(["evaluate", str(tmp_path / "small.yaml"), "--jobs", "1", "--json", str(out)]) == 0
    assert "dead_reckoning" in capsys.readouterr().out
    (square,) = json.loads(out.read_text())["squares"]
    drift = {(d["kind"], d["calibrated"]): d["drift_m"] for d in square["drifts"]}
    assert drift["dead_reckoning", True] < 0.5 * drift["dead_reckoning", False]
    assert drift["ekf", True] < 0.03


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("kind: gossip\ntitle: t\n", "kind"),
        ("kind: odometry\ntitle: t\nconfiguration: square\nsidem: 3\n", "sidem"),
        ("kind: odometry\ntitle: t\nconfiguration: square\nrecording: {wheels: none.txt, truth: none.txt}\n", "none.txt"),
    ],
)
def test_a_wrong_experiment_is_refused(tmp_path, change, said):
    path = tmp_path / "e.yaml"
    path.write_text(change)
    with pytest.raises(ConfigurationError, match=said):
        load_evaluation(str(path), None, ())


@pytest.mark.parametrize("text", ["", "point2 1 2\n" * 40, "point2 a b c\n", "point2 nan 1 2\n" * 40])
def test_positions_that_cannot_be_read_are_refused(tmp_path, text):
    path = tmp_path / "truth.txt"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=r"truth\.txt"):
        read_points(path)
