"""`trundle calibrate base` from end to end: drives a simulated base, finds its errors, writes what the odometry is to be told."""

import re
from pathlib import Path

import pytest

from drivers.interface.errors import ConfigurationError
from runtime import configuration
from runtime.assembly import assemble
from runtime.calibrate import calibrate, odometry_keys
from runtime.cli import run_command
from runtime.manoeuvres import calibration_legs, overrides_of
from runtime.run import RunOptions, run

DRIVE = Path(__file__).parents[1] / "data" / "diff_drive" / "input_excerpt.txt"
FLOOR = ("robot.camera=null", "world.margin_m=6", "loop.rate_hz=10")
RADIUS_ERROR, HEADING_ERROR_RAD = (0.02, -0.015, 0.01), (0.026, -0.01, 0.015)


def sets(changes):
    return [part for change in changes for part in ("--set", change)]


def test_an_omni_base_is_calibrated_and_the_file_can_be_run(tmp_path, capsys):
    errors = [
        f"robot.base.wheel_radius_error={list(RADIUS_ERROR)}",
        f"robot.base.wheel_heading_error_rad={list(HEADING_ERROR_RAD)}",
    ]
    path = tmp_path / "calibrated.yaml"
    assert run_command(["calibrate", "base", "square", "--output", str(path), *sets([*FLOOR, *errors])]) == 0
    assert "wheels' drift at the end" in capsys.readouterr().out
    odometry = configuration.load(str(path)).estimator.settings.odometry
    assert odometry.geometry.wheel_radius_m == pytest.approx([0.05 * (1 + error) for error in RADIUS_ERROR], rel=2e-3)
    assert odometry.geometry.heading_error_rad == pytest.approx(HEADING_ERROR_RAD, abs=2e-3)
    assert odometry.gyro_scale == pytest.approx(1.0, abs=1e-3)
    assert run_command(["calibrate", "base", "square", "--output", str(path)]) == 2  # it exists
    assert "--force" in capsys.readouterr().err


def test_a_robot_without_truth_or_base_is_refused():
    with pytest.raises(ConfigurationError, match=r"robot\.truth"):
        calibrate("square", ("robot.truth=null",))
    with pytest.raises(ConfigurationError, match=r"robot\.base"):
        calibrate("square", ("robot.base=null", "planner.name=idle"))


def test_the_manoeuvres_keep_to_the_caps_and_come_back():
    limits = configuration.load("square").devices
    base = next(choice for name, choice in limits if name == "base").settings.limits
    legs = calibration_legs(base)
    assert all(abs(leg.twist.vx) <= base.velocity.vx and abs(leg.twist.vy) <= base.velocity.vy for leg in legs)
    for axis in ("vx", "vy"):
        straight = [leg for leg in legs if leg.twist.wz == 0.0]
        assert sum(getattr(leg.twist, axis) * leg.duration_s for leg in straight) == pytest.approx(0.0)
    assert any(text.startswith("mission.time_limit_s=") for text in overrides_of(legs))


def test_a_recording_with_truth_gives_what_its_drive_gave(tmp_path, capsys):
    legs = calibration_legs(assemble(configuration.load("square", FLOOR), 0).robot.devices.base.limits)
    loaded = configuration.load("square", (*FLOOR, *overrides_of(legs)))
    log = tmp_path / "drive.rrd"
    assert run(loaded, RunOptions(seed=3, log=log)).report.outcome == "reached"
    path = tmp_path / "calibrated.yaml"
    assert run_command(["calibrate", "base", "square", "--log", str(log), "--output", str(path)]) == 0
    capsys.readouterr()
    read = configuration.load(str(path)).estimator.settings.odometry
    driven = odometry_keys(calibrate("square", FLOOR, 3))
    assert read.geometry.model_dump(mode="json") == driven["geometry"]
    assert read.gyro_bias_rad_s == driven["gyro_bias_rad_s"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["square", "--closure"], "--log"),
        (["square", "--log", "a.rrd", "--log", "b.rrd"], "--closure"),
        (["square", "--log", "none.rrd"], "none.rrd"),
        (["recorded_drive", "--set", f"robot.base.path={DRIVE}"], "--closure"),
        (["recorded_drive", "--closure", "--set", f"robot.base.path={DRIVE}"], "would close|one sense"),
    ],
)
def test_what_is_no_reference_is_refused(tmp_path, capsys, arguments, said):
    assert run_command(["calibrate", "base", *arguments, "--output", str(tmp_path / "c.yaml")]) == 2
    assert re.search(said, " ".join(capsys.readouterr().err.split()))
    assert not (tmp_path / "c.yaml").exists()


@pytest.mark.parametrize("robot", ["xlerobot", "jackal"])
def test_a_camera_is_calibrated_standing_and_the_file_can_be_run(tmp_path, capsys, robot):
    path, pitch_rad, roll_rad = tmp_path / "camera.yaml", 0.08, -0.02
    tilt = [f"robot={robot}", f"robot.camera.pitch_rad={pitch_rad}", f"robot.camera.roll_rad={roll_rad}"]
    arguments = ["calibrate", "camera", "long_corridor", "--output", str(path)]
    assert run_command([*arguments, *sets(tilt)]) == 0
    assert "ground about its plane" in capsys.readouterr().out
    loaded = configuration.load(str(path))
    camera = dict(loaded.devices)["camera"].settings
    assert loaded.robot.name == robot
    assert camera.pitch_rad == pytest.approx(pitch_rad, abs=0.003)
    assert camera.roll_rad == pytest.approx(roll_rad, abs=0.003)
    assert camera.z_m == pytest.approx(
        dict(configuration.load("long_corridor", (tilt[0],)).devices)["camera"].settings.z_m, abs=0.005
    )


def test_a_recorded_camera_is_calibrated_by_the_frames_it_took_standing(tmp_path):
    log, path = tmp_path / "stood.rrd", tmp_path / "camera.yaml"
    loaded = configuration.load("long_corridor", ("robot.camera.pitch_rad=0.1", "planner.name=idle", "mission.time_limit_s=2"))
    run(loaded, RunOptions(log=log))
    assert run_command(["calibrate", "camera", "long_corridor", "--log", str(log), "--output", str(path)]) == 0
    assert dict(configuration.load(str(path)).devices)["camera"].settings.pitch_rad == pytest.approx(0.1, abs=0.003)


@pytest.mark.parametrize(
    ("change", "said"), [("robot.camera=null", "robot.camera"), ("robot.camera.pitch_rad=-0.6", "no ground is visible")]
)
def test_a_camera_that_sees_no_ground_or_is_not_there_is_refused(tmp_path, capsys, change, said):
    path = tmp_path / "camera.yaml"
    assert run_command(["calibrate", "camera", "long_corridor", "--set", change, "--output", str(path)]) == 2
    assert said in " ".join(capsys.readouterr().err.split())
    assert not path.exists()
