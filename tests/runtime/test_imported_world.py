"""`trundle run NAME:FILE#WORLD`: an imported world is run like any other, and a wrong address is one sentence."""

import json
from pathlib import Path

import pytest

from runtime.cli import run_command

DATA = Path(__file__).parents[1] / "data"
BARN, DYNABARN, YARD = DATA / "barn/barn_2_worlds.json", DATA / "dynabarn/dynabarn_2_worlds.json", DATA / "gazebo/yard.world"
SHORT = ("--no-log", "--duration", "0.5")


@pytest.mark.parametrize(("address", "scenario"), [(f"barn:{BARN}#240", "barn"), (f"dynabarn:{DYNABARN}#0", "dynabarn")])
def test_it_is_run(address: str, scenario: str, tmp_path: Path) -> None:
    assert run_command(["run", address, *SHORT, "--json", str(tmp_path / "r.json")]) == 1  # nobody is there so soon
    report = json.loads((tmp_path / "r.json").read_text())
    assert (report["outcome"], report["scenario"], report["faults"]) == ("timed_out", scenario, [])
    assert report["min_clearance_m"] > 0.0


def test_a_gazebo_world_with_a_goal_is_driven_in(tmp_path: Path) -> None:
    goal = "mission.goals=[{x_m: 1.0, y_m: 0.0, tolerance_m: 0.8}]"
    assert run_command(["run", f"gazebo:{YARD}", "--no-log", "--set", goal, "--json", str(tmp_path / "r.json")]) == 0
    assert json.loads((tmp_path / "r.json").read_text())["path_length_m"] > 0.15


@pytest.mark.parametrize(
    ("address", "said"),
    [
        (f"barn:{BARN}#21", "there is no world 21 in it. Known: 20, 240"),
        (f"barn:{BARN}#x", "world.world: input should be a valid integer"),
        (f"barn:{BARN}", "world.world must name one of them. Known: 20, 240"),
        ("barn", "the key 'world.path' is missing"),
        ("barn:", "written NAME:FILE or NAME:FILE#WORLD, not 'barn:'"),
        ("barn:#3", "written NAME:FILE or NAME:FILE#WORLD"),
        ("barm:a.json#3", "unknown configuration 'barm'; did you mean 'barn'?"),
        (f"gazebo:{YARD}#1", "unknown key 'world.world'. Known: path"),
        ("door:a.json", "unknown key 'world.path'"),
    ],
)
def test_a_wrong_address_is_one_sentence_and_exit_code_2(address: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["run", address, *SHORT]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
