"""The session and unmodified libfranka against the emulated controller, in lockstep."""

import time

import numpy as np
import pytest

from drivers.interface.devices import DeviceState
from drivers.interface.errors import DeviceError
from tests.drivers.franka.driven import Driven
from tests.sim_drivers.firmware.fcibench import free_host, lockstep_server

BY = np.array([0.5, 0.2, -0.3, 0.2, 0.4, -0.3, 0.6])


def test_a_trajectory_is_followed_without_a_reflex_and_ends_at_rest():
    with lockstep_server() as host:
        driven = Driven(host)
        assert driven.health.state is DeviceState.OPEN
        start = driven.position_rad
        driven.turn(BY, 1.2, lifetime_s=1.6)
        driven.poll(1700)
        assert driven.health.fault == ""
        assert np.abs(driven.position_rad - start - BY).max() < 0.01
        assert driven.client.newest.mode == "Move"
        driven.poll(1000)
        assert driven.client.newest.mode == "Idle"  # it stood, and the motion has ended
        assert driven.health.expired_commands == 1
        assert driven.health.state is DeviceState.OPEN
        driven.turn(-BY, 1.2, lifetime_s=1.6)  # and it can begin another
        driven.poll(1700)
        assert np.abs(driven.position_rad - start).max() < 0.01
        driven.session.close()


def test_two_runs_are_equal_to_the_last_bit():
    def run():
        with lockstep_server(seed=4) as host:
            driven = Driven(host, decimation=1)
            driven.samples()
            driven.turn(BY, 1.0)
            driven.poll(1500)
            samples = driven.samples()[-1400:]
            driven.session.close()
        return b"".join(samples[name].tobytes() for name in ("position_rad", "velocity_rad_s", "torque_nm"))

    assert run() == run()


def test_when_its_order_expires_it_decelerates_within_the_limits_and_does_not_freeze():
    with lockstep_server() as host:
        driven = Driven(host)
        driven.turn(2.0 * np.eye(7)[0], 1.5, lifetime_s=0.75)
        driven.until(lambda: driven.health.expired_commands == 1)
        speed = driven.client.newest.target_rad_s[0]
        assert speed > 1.5
        at = driven.position_rad[0]
        driven.poll(20)
        assert 0.5 * speed < driven.client.newest.target_rad_s[0] < speed
        driven.until(lambda: np.abs(driven.client.newest.velocity_rad_s).max() < 0.02)
        assert 0.05 < driven.position_rad[0] - at < speed * 0.3
        assert driven.health.fault == ""
        driven.session.close()


def test_closing_brings_a_moving_arm_to_rest_and_ends_the_motion():
    with lockstep_server() as host:
        driven = Driven(host)
        driven.turn(2.0 * np.eye(7)[0], 1.5)
        driven.poll(750)
        assert driven.client.newest.target_rad_s[0] > 1.5
        driven.session.close()
        assert np.abs(driven.client.newest.target_rad_s).max() < 1e-2
        again = Driven(host)
        assert again.client.newest.mode == "Idle"
        assert again.health.state is DeviceState.OPEN
        again.session.close()


def test_lost_commands_and_states_are_survived():
    lossy = [{"kind": "lose_commands", "probability": 0.05}, {"kind": "lose_states", "probability": 0.02}]
    with lockstep_server(faults=lossy) as host:
        driven = Driven(host)
        start = driven.position_rad
        driven.turn(0.1 * BY, 0.6)
        driven.poll(800)
        assert driven.health.fault == ""
        assert driven.health.figures[1] > 5
        assert np.abs(driven.position_rad - start - 0.1 * BY).max() < 0.01
        driven.session.close()


@pytest.mark.parametrize(
    ("fault", "words", "mode"),
    [
        ({"kind": "reflex", "from_s": 0.4}, ["joint_reflex", "reset"], "Reflex"),
        ({"kind": "preempt", "from_s": 0.4}, ["someone else", "preempted"], "Idle"),
        ({"kind": "user_stop", "from_s": 0.4, "until_s": 0.9}, ["user stop", "release"], "UserStopped"),
        ({"kind": "lose_commands", "from_s": 0.4, "until_s": 0.6, "probability": 1.0}, ["too many", "came late"], "Reflex"),
    ],
    ids=lambda value: value.get("kind") if isinstance(value, dict) else None,
)
def test_what_stops_the_arm_is_a_fault_with_a_sentence_until_the_operators_reset(fault, words, mode):
    with lockstep_server(faults=[fault]) as host:
        driven = Driven(host)
        driven.turn(1.0 * np.eye(7)[0], 1.5)
        driven.until(lambda: driven.health.state is DeviceState.FAULTED)
        assert driven.health.fault.startswith("arm: ")
        assert all(word in driven.health.fault for word in words), driven.health.fault
        assert "\n" not in driven.health.fault
        driven.until(lambda: np.abs(driven.client.newest.target_rad_s).max() < 1e-3)  # the controller has braked
        assert driven.client.newest.mode == mode
        driven.turn(1.0 * np.eye(7)[0], 1.5)
        driven.poll(20)
        assert driven.client.newest.mode == mode  # no order moves it
        if mode == "UserStopped":
            driven.session.clear_faults()
            driven.poll(5)
            assert driven.health.state is DeviceState.FAULTED  # still pressed
        driven.client.close()


def test_the_operators_reset_recovers_from_a_reflex_and_the_arm_moves_again():
    with lockstep_server(faults=[{"kind": "reflex", "from_s": 0.4}]) as host:
        driven = Driven(host)
        driven.turn(1.0 * np.eye(7)[0], 1.5)
        driven.until(lambda: driven.health.state is DeviceState.FAULTED)
        driven.session.clear_faults()
        driven.poll(5)
        assert driven.health.state is DeviceState.OPEN
        assert driven.client.newest.mode == "Idle"
        driven.poll(50)
        driven.turn(-0.2 * np.eye(7)[0], 0.6)
        driven.until(lambda: driven.client.newest.mode == "Move")
        driven.poll(300)
        assert driven.health.fault == ""
        driven.session.close()


def test_it_recovers_by_itself_only_where_that_is_asked_for():
    with lockstep_server(faults=[{"kind": "reflex", "from_s": 0.4}]) as host:
        driven = Driven(host, auto_recover=True)
        driven.turn(1.0 * np.eye(7)[0], 1.5)
        driven.poll(700)
        assert driven.health.state is DeviceState.OPEN
        assert driven.client.newest.mode in {"Idle", "Move"}
        driven.session.close()


def test_a_controller_that_falls_silent_is_a_lost_wire():
    with lockstep_server(faults=[{"kind": "silent", "from_s": 0.3}]) as host:
        driven = Driven(host)
        driven.turn(1.0 * np.eye(7)[0], 1.5)
        with pytest.raises(DeviceError, match=r"arm: the arm at .* is lost"):
            driven.poll(500)
        driven.client.close()


def test_a_controller_that_hangs_up_is_a_lost_wire_and_the_arm_waits_for_a_reset_when_it_is_back():
    with lockstep_server(faults=[{"kind": "disconnect", "from_s": 0.3}]) as host:
        driven = Driven(host)
        driven.turn(1.0 * np.eye(7)[0], 1.5)
        with pytest.raises(DeviceError, match="is lost"):
            driven.poll(500)
        driven.client.close()
        again = reconnected(host)
        again.poll(50)
        assert again.health.state is DeviceState.FAULTED
        again.session.clear_faults()
        again.poll(5)
        assert again.health.state is DeviceState.OPEN
        again.session.close()


def reconnected(host, tries=100):
    """Connect as soon as the controller has let go of the last client."""
    for _ in range(tries):
        try:
            return Driven(host, reopened=True)
        except DeviceError:
            time.sleep(0.02)
    raise AssertionError("it never came back")


@pytest.mark.parametrize(("settings", "words"), [({"protocol_version": 9}, "ersion"), (None, "refused")])
def test_says_in_one_sentence_why_it_cannot_connect(settings, words):
    if settings is None:
        with pytest.raises(DeviceError, match=words) as refusal:
            Driven(free_host())
    else:
        with lockstep_server(**settings) as host, pytest.raises(DeviceError, match=words) as refusal:
            Driven(host)
    assert str(refusal.value).startswith("arm: ")
    assert "\n" not in str(refusal.value)


def test_what_cannot_be_is_dropped_and_counted():
    script = [{"kind": "nan", "from_s": 0.3, "until_s": 0.5}, {"kind": "freeze", "from_s": 0.7, "until_s": 0.9}]
    with lockstep_server(faults=script) as host:
        driven = Driven(host)
        driven.turn(0.5 * np.eye(7)[0], 1.2)
        driven.poll(1200)
        samples = driven.samples()
        assert np.isfinite(samples["position_rad"]).all()
        assert driven.health.dropped == pytest.approx(38, abs=3)
        assert (np.diff(samples["captured_ns"]) > 0).all()
        assert (np.diff(samples["sequence"]) > 0).all()
        driven.session.close()


def test_a_speed_factor_is_kept():
    with lockstep_server() as host:
        driven = Driven(host)
        driven.turn(2.0 * np.eye(7)[0], 1.5, speed_factor=0.3)
        fastest = 0.0
        for _ in range(1500):
            driven.poll()
            fastest = max(fastest, abs(driven.client.newest.target_rad_s[0]))
        assert 0.25 * 2.175 < fastest < 0.31 * 2.175
        driven.session.close()
