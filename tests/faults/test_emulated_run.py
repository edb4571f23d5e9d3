"""The real driver, the real wire, another process: a run against `trundle emulate` is a run."""

import json
from pathlib import Path

from tests.faults.emulated import PATIENCE_S, emulated, trundle, until

GOAL = "mission.goals=[{x_m: 0.8, y_m: 0.3, tolerance_m: 0.15}]"


def test_two_runs_after_each_other_reach_their_goal_each_in_a_world_of_its_own(tmp_path: Path) -> None:
    with emulated() as robot:
        for number in range(2):
            report = tmp_path / f"{number}.json"
            arguments = ("--set", GOAL, "--duration", "60", "--log", str(tmp_path / f"{number}.rrd"), "--json", str(report))
            with robot.run(*arguments) as run:
                said, _ = run.communicate(timeout=2 * PATIENCE_S)
            told = json.loads(report.read_text())
            assert told["outcome"] == "reached", said
            assert run.returncode == 0
            assert 0.6 < told["path_length_m"] < 1.5  # from the start again
            assert told["min_clearance_m"] > 0.5
            assert told["odometry_error_m"] < 0.1
            until(lambda expected=number + 2: robot.worlds == expected, "the world was not made anew")


def test_what_the_doctor_finds_of_an_emulated_base(tmp_path: Path) -> None:
    with emulated() as robot, trundle("doctor", "square", *robot.changes, "--json", "told.json", cwd=tmp_path) as doctor:
        said, _ = doctor.communicate(timeout=PATIENCE_S)
        findings = json.loads((tmp_path / "told.json").read_text())["findings"]
    found = {f["check"]: f for f in findings if f["subject"] == "base"}
    assert "0.6" in found["present"]["told"], said
    assert found["first command"]["verdict"] == "good"
    assert found["watchdog"]["verdict"] == "good"
    assert "WATCHDOG_TIMER_EXPIRED" in found["watchdog"]["told"]
    assert found["battery"]["verdict"] == "good"
