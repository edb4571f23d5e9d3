"""The session and unmodified libfranka against the emulated controller, in lockstep."""

import numpy as np

from drivers.interface.devices import DeviceState
from tests.drivers.franka.driven import Driven
from tests.sim_drivers.firmware.fcibench import lockstep_server

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
