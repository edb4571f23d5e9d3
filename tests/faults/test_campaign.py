"""Devices that misbehave by script: answered as the script says, and in lockstep the same again, bit for bit."""

import pytest

from drivers.interface.errors import ConfigurationError
from runtime import configuration
from runtime.assembly import assemble
from runtime.log.reading.read import same_content
from tests.faults.campaign import Script, findings, scripts, simulated

SHORT = {"changes": ("mission.goals=[{x_m: 0.8, y_m: 0.0}]", "mission.time_limit_s=6"), "at_s": 0.5, "for_s": 0.6}


@pytest.mark.parametrize(("device", "kind"), [("camera", "freeze"), ("base", "delay")])
def test_the_same_script_gives_the_same_log(device, kind, tmp_path):
    script = Script(configuration="square", cases=({"device": device, "kind": kind},), **SHORT)
    for name in ("one", "other"):
        watch, result = simulated(script, dict(script.cases[0]), tmp_path / f"{name}.rrd")
        assert result.failure is None
        assert watch.faults
    assert same_content(tmp_path / "one.rrd", tmp_path / "other.rrd") == ""


def test_what_is_answered_otherwise_than_expected_is_found(tmp_path):
    cases = ({"device": "imu", "kind": "nan", "answer": "stand_down"}, {"device": "imu", "kind": "nan", "answer": "run"})
    right, wrong = findings("short", Script(configuration="square", cases=cases, **SHORT), tmp_path / "log.rrd")
    assert (right.wrong, wrong.wrong) == ("", "run was expected")
    assert right.watch.answered_s == pytest.approx(0.0, abs=0.051)
    assert right.watch.zero_s is not None
    assert right.watch.resumed


def test_every_script_can_be_read_and_names_devices_that_are_there():
    found = scripts()
    assert {"simulated", "can"} <= set(found)
    known = {name for name, _ in configuration.load("square").devices}
    assert {case["device"] for script in found.values() if script.robot is None for case in script.cases} <= known


def test_a_script_for_a_device_that_is_not_there_is_refused():
    loaded = configuration.load("square", ("robot.faults=[{device: wings, kind: drop}]",))
    with pytest.raises(ConfigurationError, match=r"robot.faults: the robot has no device 'wings'. Known: camera, imu, base"):
        assemble(loaded, 0)
