"""The scripted operator: what is said when, and by which clock."""

import pytest
from pydantic import ValidationError

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceSetup, DeviceState, Operator
from drivers.interface.mission import Goal
from drivers.interface.samples import EmergencyStop, Jog, NewGoal, ResetFaults, SetEnabled, SetPaused
from sim_drivers.script import ScriptedOperator, ScriptSettings

SECOND = 1_000_000_000


class Time:
    now_ns = 5 * SECOND


def operator(*events):
    time = Time()
    settings = ScriptSettings(events=events) if events else ScriptSettings()
    return time, ScriptedOperator(settings, DeviceSetup("operator", 1, lambda: time.now_ns))


def said(events):
    return [event.action for event in events]


def test_without_a_script_the_robot_is_enabled_at_once():
    _, nobody = operator()
    assert isinstance(nobody, Operator)
    nobody.open()
    assert said(nobody.drain()) == [SetEnabled(True)]
    assert nobody.drain() == ()


def test_events_come_when_they_are_due_after_opening_and_in_order():
    time, script = operator(
        {"at_s": 2.0, "action": "jog", "vx": 0.2, "wz": -0.1, "duration_s": 1.5},
        {"at_s": 0.0, "action": "enable"},
        {"at_s": 2.0, "action": "pause"},
        {"at_s": 3.0, "action": "goal", "x_m": 4.0, "y_m": -1.0},
    )
    script.open()
    assert said(script.drain()) == [SetEnabled(True)]
    time.now_ns += SECOND
    assert script.drain() == ()
    time.now_ns += 3 * SECOND // 2  # a late loop: 2.5 s
    jog, pause = script.drain()
    assert jog.action == Jog(BodyTwist(0.2, 0.0, -0.1), expires_ns=5 * SECOND + 7 * SECOND // 2)
    assert (jog.stamp.captured_ns, jog.stamp.received_ns) == (7 * SECOND, 5 * SECOND + 5 * SECOND // 2)
    assert pause.action == SetPaused(True)
    time.now_ns += 100 * SECOND
    assert said(script.drain()) == [NewGoal(Goal(4.0, -1.0))]
    time.now_ns += 100 * SECOND
    assert script.drain() == ()
    assert script.health().state is DeviceState.OPEN
    assert script.health().received == 4


def test_every_switch_says_what_it_is_named_for():
    words = ("enable", "disable", "estop", "reset", "pause", "resume")
    _, script = operator(*({"at_s": 0.0, "action": word} for word in words))
    script.open()
    expected = [SetEnabled(True), SetEnabled(False), EmergencyStop(), ResetFaults(), SetPaused(True), SetPaused(False)]
    assert said(script.drain()) == expected


def test_nothing_is_said_before_opening_and_after_closing():
    _, script = operator()
    assert script.drain() == ()
    for _ in range(2):
        script.stop()
        script.close()
    script.open()
    script.close()
    assert script.drain() == ()
    assert script.health().state is DeviceState.CLOSED


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        ({"at_s": 0.0, "action": "dance"}, "action"),
        ({"at_s": -1.0, "action": "enable"}, "at_s"),
        ({"at_s": 0.0, "action": "jog", "vx": 0.1}, "duration_s"),
        ({"at_s": 0.0, "action": "goal", "x_m": 1.0}, "y_m"),
        ({"at_s": 0.0, "action": "estop", "vx": 1.0}, "vx"),
    ],
)
def test_a_wrong_event_is_refused_by_its_key(wrong, key):
    with pytest.raises(ValidationError, match=key):
        ScriptSettings(events=[wrong])
