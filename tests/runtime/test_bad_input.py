"""Bad input at the command line: one sentence that names the key and the choices, exit code 2, nothing left behind."""

from pathlib import Path

import pytest

from runtime.cli import run_command


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["run", "dynamic_halway"], "unknown configuration 'dynamic_halway'; did you mean 'dynamic_hallway'? Known: "),
        (["run", "nowhere/at_all.yaml"], "there is no file 'nowhere/at_all.yaml'"),
        (
            ["run", "door", "--set", "planner.name=dwaa"],
            "planner.name: unknown planner 'dwaa'; did you mean 'dwa'? Known: clearance_manifold",
        ),
        (["run", "door", "--set", "world.scenario=dor"], "world.scenario: unknown scenario 'dor'; did you mean 'door'?"),
        (["run", "door", "--set", "robot.base.driver=sim_omi"], "robot.base.driver: unknown driver 'sim_omi'"),
        (["run", "door", "--set", "robot=xlerobo"], "unknown robot 'xlerobo'; did you mean 'xlerobot'?"),
        (
            ["run", "door", "--set", "robot.camera={driver: sim_imu}"],
            "drives the imu, not the camera. Known for the camera:",
        ),
        (["run", "door", "--set", "loop.rate=20"], "unknown key 'loop.rate'. Known: rate_hz, realtime"),
        (["run", "door", "--set", "loops.rate_hz=20"], "unknown key 'loops'. Known: robot, world"),
        (["run", "door", "--set", "robot.wheels=3"], "unknown key 'robot.wheels'. Known: name, radius_m"),
        (["run", "door", "--set", "planner.horizon=3"], "unknown key 'planner.horizon'. Known: "),
        (["run", "door", "--set", "supervisor.deadline_ladder.jump=3"], "deadline_ladder.jump'. Known: hold, decelerate"),
        (["run", "door", "--set", "supervisor.deadline_ladder.hold=9"], "the rungs must ascend"),
        (["run", "door", "--set", "loop.rate_hz=fast"], "loop.rate_hz: input should be a valid number"),
        (["run", "door", "--set", "loop.rate_hz=-5"], "loop.rate_hz: input should be greater than 0, not -5"),
        (["run", "door", "--set", "loop.rate_hz=.nan"], "loop.rate_hz: "),
        (["run", "door", "--set", "loop.rate_hz=30"], "not a whole multiple of the physics step of 5 ms"),
        (["run", "door", "--set", "robot=7"], "robot takes a name or keys; known: "),
        (["run", "door", "--set", "robot=jackal", "--set", "planner.name=point_ds"], "point_ds"),
        (["run", "door", "--seed", "-1"], "--seed"),
        (["run", "door", "--duration", "0"], "--duration takes seconds, more than 0 and finite, not 0"),
        (["run", "door", "--duration", "nan"], "--duration takes seconds, more than 0 and finite, not nan"),
        (["run", "door", "--log", "x.txt"], "--log takes a file that ends in .rrd, as the viewer does; not x.txt"),
        (["run", "door", "--json", "."], "--json . is a folder, not a file"),
        (["run", "door", "--log", "/dev/null/a.rrd"], "the folder of --log /dev/null/a.rrd cannot be made"),
        (["evaluate", "baselines", "--json", "/dev/null/a.json"], "the folder of --json /dev/null/a.json cannot be made"),
        (["run"], "CONFIG"),
        (["drive", "door"], "No such command 'drive'"),
        (["review", "missing.rrd"], "missing.rrd"),
        (["evaluate", "baseline"], "unknown experiment 'baseline'; did you mean 'baselines'?"),
    ],
)
def test_one_sentence_and_exit_code_2(
    arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_command(arguments) == 2
    complaint = " ".join(capsys.readouterr().err.split())
    assert sentence in complaint
    assert "Traceback" not in complaint
    assert not list(tmp_path.rglob("*.rrd"))


def test_an_existing_log_is_not_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "a.rrd"
    log.write_bytes(b"precious")
    assert run_command(["run", "door", "--log", str(log)]) == 2
    assert "exists already; --force overwrites it" in capsys.readouterr().err
    assert log.read_bytes() == b"precious"


def test_a_device_that_is_not_there_is_exit_code_3_and_leaves_nothing_behind(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", None)
    assert run_command(["run", "door", "--set", "robot.operator={driver: keyboard}"]) == 3
    assert "error: operator: the keyboard operator needs a terminal" in " ".join(capsys.readouterr().err.split())
    assert not list(tmp_path.rglob("*.rrd"))
