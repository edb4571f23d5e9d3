"""Each robot over the wire that it has on the robot, and what the doctor says when nobody is at the other end."""

import json
from pathlib import Path

import pytest

from tests.faults.emulated import PATIENCE_S, emulated, trundle
from tests.sim_drivers.firmware.fcibench import free_host

ROVER = str(Path(__file__).parent / "mavlink_robot.yaml")


def findings(tmp_path: Path, scenario: str, changes: list[str]) -> tuple[int, dict[str, dict[str, dict[str, str]]], str]:
    """Return the doctor's exit code, what it found by subject and check, and what it printed."""
    with trundle("doctor", scenario, *changes, "--json", "told.json", cwd=tmp_path) as doctor:
        said, _ = doctor.communicate(timeout=PATIENCE_S)
    found: dict[str, dict[str, dict[str, str]]] = {}
    for finding in json.loads((tmp_path / "told.json").read_text())["findings"]:
        found.setdefault(finding["subject"], {})[finding["check"]] = finding
    return doctor.returncode, found, said


def test_the_rover_drives_over_a_serial_line(tmp_path: Path) -> None:
    """A pseudo-terminal in the place of the port; at 115,200 baud its streams must not be more than such a line carries."""
    port, report = tmp_path / "ttyACM0", tmp_path / "report.json"
    wires = (f"robot.base.url=serial:{port}:115200", "robot.base.connect_s=20")
    with emulated(robot=ROVER, wires=wires) as robot:
        goal = "mission.goals=[{x_m: 0.8, y_m: 0.2, tolerance_m: 0.2}]"
        arguments = ("--set", goal, "--duration", "40", "--log", str(tmp_path / "run.rrd"), "--json", str(report))
        with robot.run(*arguments) as run:
            said, _ = run.communicate(timeout=2 * PATIENCE_S)
        told = json.loads(report.read_text())
        assert told["outcome"] == "reached", said
        assert told["path_length_m"] > 0.5
    assert not port.is_symlink()


def test_the_doctor_examines_an_emulated_arm(tmp_path: Path) -> None:
    wires = (f"robot.arm.host={free_host()}", "robot.camera.memory=doctor-{port}")
    with emulated(robot="franka_emulated", wires=wires, scenario="arm_waypoints") as robot:
        _, found, said = findings(tmp_path, "arm_waypoints", robot.changes)
    assert "FCI" in found["arm"]["present"]["told"], said
    assert found["arm"]["first command"]["verdict"] == "good", said
    assert found["camera"]["present"]["verdict"] == "good", said


@pytest.mark.parametrize(
    ("scenario", "robot", "missing"),
    [
        ("arm_waypoints", "franka_real", {"camera": "no RealSense camera is connected", "arm": "127.0.0.66"}),
        ("static_corridor", "jackal_real", {"camera": "no RealSense camera is connected", "base": "/dev/no-such-port"}),
    ],
)
def test_the_doctor_says_what_of_a_robot_is_missing(tmp_path: Path, scenario: str, robot: str, missing: dict[str, str]) -> None:
    wires = {
        "franka_real": ["robot.arm.host=127.0.0.66"],
        "jackal_real": ["robot.base.url=serial:/dev/no-such-port:115200", "robot.imu.url=serial:/dev/no-such-port:115200"],
    }
    changes = [f"robot={robot}", *wires[robot], "robot.operator.driver=script"]
    code, found, said = findings(tmp_path, scenario, [word for change in changes for word in ("--set", change)])
    assert code == 3, said
    for subject, words in missing.items():
        assert found[subject]["present"]["verdict"] == "forbids", said
        assert words in found[subject]["present"]["told"], said
