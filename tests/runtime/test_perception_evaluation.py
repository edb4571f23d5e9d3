"""`trundle evaluate perception` from its file to its table."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from drivers.interface.errors import ConfigurationError
from runtime.cli import run_command
from runtime.evaluations.evaluation import load_evaluation

FRAMES = Path(__file__).parents[1] / "data" / "realsense_depth"
SMALL = f"""
kind: perception
title: small
front_ends: {{plain: []}}
scenes:
  crossing: {{configuration: hidden_crossing, front_ends: [plain]}}
seeds: 1
frames:
  path: {FRAMES}
  width: 640
  height: 480
  fx_px: 383.0
  fy_px: 383.0
  cx_px: 320.0
  cy_px: 240.0
  depth: {{raw: {{}}}}
  memory: {{rolling: {{}}}}
"""


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(SMALL)
    return path


def test_the_table_says_what_was_found_and_on_how_much(small, tmp_path):
    out, table = tmp_path / "out.json", tmp_path / "out.md"
    assert run_command(["evaluate", str(small), "--jobs", "1", "--json", str(out), "--markdown", str(table)]) == 0
    found = json.loads(out.read_text())
    (one,), (played,) = found["runs"], found["frames"]
    assert one["tracks"]["looks"] > 30
    assert one["tracks"]["switches"] == 0
    assert one["tracks"]["position_rms_m"] < 0.12
    assert one["grid"]["missed_points"] <= 0.01 * one["grid"]["surface_points"]
    assert (played["frames"], played["phantom_cells"]) == (2, 0)
    assert played["occupied_cells"] > 100
    assert f"| 2 recorded frames | raw, rolling | 1 |  |  |  |  |  |  | 0 of {played['occupied_cells']} |" in table.read_text()


def test_a_scene_with_nobody_in_it_has_no_errors_to_report(small, tmp_path):
    out = tmp_path / "out.json"
    changes = ["--set", "world.meet_s=60", "--set", "world.time_limit_s=1"]
    assert run_command(["evaluate", str(small), "--jobs", "1", "--json", str(out), *changes]) == 0
    (one,) = json.loads(out.read_text())["runs"]
    assert (one["tracks"]["looks"], one["tracks"]["position_rms_m"]) == (0, None)


def test_frames_of_another_size_or_none_at_all_are_refused(small, tmp_path, capsys):
    with pytest.raises(ConfigurationError, match=r"frames\.path"):
        load_evaluation(str(small), None, (f"frames.path={tmp_path}",))
    cv2.imwrite(str(tmp_path / "0.png"), np.full((8, 8), 1000, dtype=np.uint16))
    changes = ("--set", "world.time_limit_s=0.2", "--set", f"frames.path={tmp_path}")
    assert run_command(["evaluate", str(small), "--jobs", "1", *changes]) == 2
    assert "640x480" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(("old", "new", "said"), [("[plain]", "[fancy]", "fancy"), ("seeds: 1", "seeds: 0", "seeds")])
def test_a_wrong_experiment_is_refused(small, old, new, said):
    small.write_text(SMALL.replace(old, new))
    with pytest.raises(ConfigurationError, match=said):
        load_evaluation(str(small), None, ())
