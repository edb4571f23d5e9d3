"""The session against emulated autopilots, which frame with pymavlink and behave by tables of their own; in lockstep."""

import contextlib
import math
import socket
import struct

import numpy as np
import pytest

from drivers.interface.devices import DeviceState
from drivers.rover_serial.frames import Framer
from drivers.rover_serial.session import Phase
from tests.drivers.rover_serial.golden import COMMAND_LONG, SET_POSITION, frame, heartbeat
from tests.drivers.rover_serial.lockstep import lockstep

KEY, OTHER = bytes(range(32)), bytes(32)
KINDS = ("ardupilot", "px4")


def of_kind(kind, firmware=None, **settings):
    return lockstep({"kind": kind} | (firmware or {}), reverse=kind == "ardupilot", **settings)


@pytest.fixture
def key_file(tmp_path):
    file = tmp_path / "key"
    file.write_bytes(KEY)
    return file


@pytest.mark.parametrize("kind", KINDS)
def test_it_greets_arms_drives_rests_and_disarms(kind):
    with of_kind(kind) as both:
        both.wait(3.0)
        assert both.is_open, both.health.fault or both.lost
        assert both.health.firmware.endswith("4.8.0")
        assert not both.firmware.state.armed
        both.wait(2.0, (0.5, 0.0))
        before = both.place
        both.wait(2.0, (0.5, 0.0))
        assert both.place[0] - before[0] == pytest.approx(1.0, abs=0.1)
        assert both.session._phase is Phase.DRIVING
        both.wait(1.0)  # the command has expired
        assert both.health.expired_commands == 1
        assert both.speed() < 0.02
        assert both.firmware.state.armed
        both.wait(2.0)
        assert not both.firmware.state.armed
        assert both.firmware.state.timeouts == 0  # zero came long before
        assert both.is_open


@pytest.mark.parametrize("kind", KINDS)
def test_left_is_left(kind):
    with of_kind(kind) as both:
        both.wait(5.0)
        both.wait(5.0, (0.4, 0.4))
        yaw = both.world.data.qpos[3:7]
        assert 2.0 * math.atan2(yaw[3], yaw[0]) == pytest.approx(0.4 * 4.0, abs=0.7)
        assert both.place[1] > 0.3
        gyro = both.samples("imu")["gyro_rad_s"][-20:]
        assert gyro[:, 2].mean() == pytest.approx(0.4, abs=0.12)


def test_wheels_say_how_far_it_went():
    with lockstep(wheel_order=(3, 1), wheel_signs=(1, -1)) as both:
        both.wait(3.0)
        both.wait(4.0, (0.5, 0.3))
        samples = both.samples()
        assert (np.diff(samples["captured_ns"]) > 0).all()
        assert (samples["captured_ns"] <= samples["received_ns"]).all()
        assert np.diff(samples["sequence"]).max() == 1
        assert np.diff(samples["captured_ns"]).mean() == pytest.approx(40e6, rel=0.02)
        left, right = samples["distance_m"][-1]
        assert 0.5 * (left + right) == pytest.approx(1.7, abs=0.25)
        assert right > left
        assert samples["rate_m_s"][-20:].mean() == pytest.approx(0.5, abs=0.03)


def test_the_clocks_are_brought_together():
    """A sample is a few milliseconds old; the autopilot's clock began elsewhere."""
    with lockstep({"latency_s": 0.004}) as both:
        both.wait(4.0)
        samples = both.samples()
        age_ms = (samples["received_ns"] - samples["captured_ns"]) * 1e-6
        assert age_ms.min() >= 0.0
        assert age_ms.max() <= 20.0
        assert both.session._clock.known


def test_gravity_points_down_in_samples_of_either_message():
    for kind in KINDS:
        with of_kind(kind) as both:
            both.wait(4.0)
            accel = both.samples("imu")["accel_m_s2"].mean(axis=0)
            assert accel == pytest.approx((0.0, 0.0, 9.8), abs=0.3)


def test_without_wheel_encoders_the_position_is_taken_and_said_so():
    with lockstep({"wheel_encoders": False}) as both:
        both.wait(4.0)
        assert "odometry from LOCAL_POSITION_NED" in both.health.protocol
        both.samples("pose")
        both.wait(4.0, (0.5, 0.4))
        assert not len(both.samples("wheels"))
        last = both.samples("pose")[-1]
        assert last["pose"][:2] == pytest.approx(both.place, abs=0.1)
        assert last["twist"] == pytest.approx((0.5, 0.0, 0.4), abs=0.12)


def test_a_stream_that_is_too_fast_is_asked_for_half_as_often():
    with lockstep({"fastest_stream_hz": 25.0}, rate_hz=50.0) as both:
        both.wait(3.0)
        assert "at 25 Hz" in both.health.protocol


def test_wheels_that_are_required_and_missing_are_named():
    with lockstep({"wheel_encoders": False}, odometry="wheels") as both:
        both.wait(4.0)
        assert "it does not send WHEEL_DISTANCE" in both.lost


def test_a_refusal_to_arm_is_told_in_the_autopilots_words():
    with lockstep({"arming_refused": "Hardware safety switch"}, ready_s=0.5) as both:
        both.wait(4.0)
        assert "not ready to be armed after 0.5 s" in both.lost
    with lockstep({"estimate_s": 1.2}, arm_s=0.5) as both:
        both.wait(3.0)
        assert both.is_open
        both.firmware._settings = both.firmware.state._settings = both.firmware._settings.model_copy(
            update={"arming_refused": "Battery below minimum arming voltage"}
        )
        both.wait(2.0, (0.5, 0.0))
        assert both.health.state is DeviceState.FAULTED
        assert both.health.fault == "base: arming was failed: Arm: Battery below minimum arming voltage"
        assert both.speed() < 0.02


def test_what_disarms_by_itself_is_armed_again_only_after_a_reset():
    with lockstep({"faults": [{"kind": "disarm", "from_s": 5.0}]}) as both:
        both.wait(3.0)
        both.wait(2.5, (0.5, 0.0))
        assert both.health.state is DeviceState.FAULTED
        assert both.health.fault == "base: the autopilot has disarmed: Crash: Disarming"
        both.wait(1.0, (0.5, 0.0))
        assert both.speed() < 0.02
        both.session.clear_faults()
        both.wait(2.0, (0.5, 0.0))
        assert both.is_open
        assert both.speed() > 0.4


def test_somebody_who_takes_over_is_let():
    with lockstep({"faults": [{"kind": "leave_mode", "from_s": 5.0}]}) as both:
        both.wait(3.0)
        both.wait(3.0, (0.5, 0.0))
        assert "has left GUIDED" in both.health.fault
        assert both.firmware.state.mode == 0


def test_a_lost_wire_is_found_again_and_waits_for_the_reset():
    with lockstep({"faults": [{"kind": "disconnect", "from_s": 5.0}]}) as both:
        both.wait(3.0)
        both.wait(3.0, (0.5, 0.0))
        assert "closed by the other end" in both.lost
        both.reconnect().wait(3.0, (0.5, 0.0))
        assert both.health.state is DeviceState.FAULTED
        assert "armed again after the operator's reset" in both.health.fault
        assert both.speed() < 0.02
        assert not both.firmware.state.armed
        both.session.clear_faults()
        both.wait(2.5, (0.5, 0.0))
        assert both.speed() > 0.4


@pytest.mark.parametrize("kind", ["reboot", "silent"])
def test_an_autopilot_that_restarts_or_falls_silent_is_lost(kind):
    with lockstep({"faults": [{"kind": kind, "from_s": 5.0}]}) as both:
        both.wait(3.0)
        both.wait(4.0, (0.3, 0.0))
        assert "has restarted" in both.lost or "samples have come" in both.lost or "no odometry has come" in both.lost


def test_its_own_timeouts_stop_it_when_the_process_at_the_wire_is_gone():
    for kind, timeout_s in (("ardupilot", 3.0), ("px4", 0.5)):
        with of_kind(kind) as both:
            both.wait(3.0)
            both.wait(4.0, (0.5, 0.0))
            assert both.speed() > 0.4
            both.world.step_to(both.world.now_ns + round((timeout_s - 0.2) * 1e9))
            assert both.speed() > 0.4
            both.world.step_to(both.world.now_ns + 1_200_000_000)
            assert both.speed() < 0.02
            assert both.firmware.state.timeouts == 1


def test_the_stations_silence_is_a_failsafe_where_it_is_on():
    with lockstep({"gcs_failsafe": True, "gcs_timeout_s": 1.0}) as both:
        both.wait(3.0)
        both.wait(2.0, (0.5, 0.0))
        both.world.step_to(both.world.now_ns + 2_500_000_000)
        assert both.firmware.state.mode == 4  # HOLD
        assert both.speed() < 0.02


def test_px4_refuses_offboard_without_a_stream_before():
    with of_kind("px4") as both:
        both.wait(3.0)
        both.session.poll(both.world.now_ns)
        assert both.firmware.state.set_mode(1.0, 6.0, 0.0, both.world.now_ns) != 0


def test_px4_cannot_reverse_and_says_so():
    with lockstep({"kind": "px4"}, reverse=True) as both:
        both.wait(2.0)
        assert both.lost == "base: PX4 turns round to where a velocity points; set 'reverse: false'"


def test_another_autopilot_than_was_told_is_refused():
    with lockstep({"kind": "px4"}, autopilot="ardupilot") as both:
        both.wait(2.0)
        assert "the autopilot is PX4, and the settings say ardupilot" in both.lost


@pytest.mark.parametrize("fault", ["drop", "corrupt", "truncate", "noise", "other_system", "replay"])
def test_a_bad_link_is_counted_and_driven_over(fault):
    script = [{"kind": fault, "from_s": 3.0, "probability": 0.2}]
    with lockstep({"faults": script}) as both:
        both.wait(3.0)
        assert both.is_open
        before = both.health.dropped + both.health.foreign
        both.wait(4.0, (0.5, 0.0))
        assert both.is_open, both.health.fault or both.lost
        assert both.place[0] > 1.0
        assert both.health.dropped + both.health.foreign > before or fault == "noise"
        samples = both.samples()
        assert (np.diff(samples["captured_ns"]) > 0).all()
        assert (np.abs(samples["rate_m_s"]) < 1.0).all()


def test_values_that_are_none_are_dropped():
    with lockstep({"faults": [{"kind": "nan", "from_s": 5.0, "until_s": 5.5}]}) as both:
        both.wait(3.0)
        both.wait(4.0, (0.3, 0.0))
        assert both.is_open
        assert both.health.dropped > 5
        assert np.isfinite(both.samples()["distance_m"]).all()


def test_a_clock_that_jumps_ahead_does_not_make_samples_of_the_future():
    with lockstep({"faults": [{"kind": "clock_jump", "from_s": 5.0}]}) as both:
        both.wait(3.0)
        both.wait(5.0, (0.3, 0.0))
        samples = both.samples()
        assert (samples["captured_ns"] <= samples["received_ns"]).all()


def test_with_a_key_all_is_signed(key_file):
    with lockstep(key=KEY, key_file=key_file) as both:
        both.wait(3.0)
        assert both.is_open, both.lost
        assert "MAVLink 2, signed" in both.health.protocol
        both.wait(2.0, (0.5, 0.0))
        assert both.speed() > 0.4


def test_with_another_key_neither_listens(tmp_path, key_file):
    other = tmp_path / "other"
    other.write_bytes(OTHER)
    with lockstep(key=KEY, key_file=key_file, their_key_file=other, connect_s=2.0) as both:
        both.wait(3.0)
        assert "is not signed with the key in" in both.lost
        assert both.health.foreign > 0


@pytest.mark.parametrize("fault", ["forge", "replay"])
def test_with_a_key_forged_and_replayed_frames_change_nothing(key_file, fault):
    """The forged heartbeats say that it is disarmed."""
    with lockstep({"faults": [{"kind": fault, "from_s": 4.0}]}, key=KEY, key_file=key_file) as both:
        both.wait(3.0)
        both.wait(4.0, (0.5, 0.0))
        assert both.is_open, both.health.fault
        assert both.health.foreign > 10
        assert both.speed() > 0.4


def test_without_a_key_the_same_forgery_would_have_stopped_it():
    with lockstep({"faults": [{"kind": "forge", "from_s": 4.0}]}) as both:
        both.wait(3.0)
        both.wait(4.0, (0.5, 0.0))
        assert "the autopilot has disarmed" in both.health.fault


def test_udp_is_a_wire_too():
    for scheme in ("udp", "udpin"):
        with lockstep(scheme=scheme) as both:
            both.wait(3.0)
            assert both.is_open, both.lost
            both.wait(2.0, (0.5, 0.0))
            assert both.speed() > 0.4


def test_the_emulated_autopilot_obeys_bytes_packed_by_hand():
    """So an error that driver and emulation share cannot hide."""
    with lockstep() as both:
        both.session.close()
        address = ("127.0.0.1", both.settings.place.number)
        with socket.create_connection(address) as link:
            heard, framer, sequence = [], Framer(), 0

            def say(message, payload):
                nonlocal sequence
                link.sendall(frame(message, payload, system=255, component=190, sequence=sequence))
                sequence = (sequence + 1) % 256
                wait(0.02)

            def wait(seconds):
                both.world.step_to(both.world.now_ns + round(seconds * 1e9))
                link.setblocking(False)
                with contextlib.suppress(BlockingIOError):
                    heard.extend(framer.feed(link.recv(65536)))
                link.setblocking(True)

            wait(2.0)
            link.sendall(heartbeat(kind=6, autopilot=8, system=255, component=190))
            wait(1.0)
            say(COMMAND_LONG, struct.pack("<7fHBBB", 1, 15, 0, 0, 0, 0, 0, 176, 1, 1, 0))  # GUIDED
            say(COMMAND_LONG, struct.pack("<7fHBBB", 1, 0, 0, 0, 0, 0, 0, 400, 1, 1, 0))  # arm
            wait(0.1)
            acks = [struct.unpack_from("<HB", read.payload + bytes(3)) for read in heard if read.message_id == 77]
            assert acks == [(176, 0), (400, 0)]
            for _ in range(40):
                say(SET_POSITION, struct.pack("<I11fHBBB", 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0, 0, 0.4, 0x5C7, 1, 1, 9))
                wait(0.03)
            assert both.speed() == pytest.approx(0.5, abs=0.08)
            assert both.place[1] < -0.02  # clockwise
            wait(1.1)
            beats = [read.payload for read in heard if read.message_id == 0]
            assert struct.unpack_from("<IBBB", beats[-1]) == (15, 10, 3, 1 | 8 | 128)


def test_a_set_point_that_is_no_number_is_the_end_of_an_ardupilot():
    """What the simulated one did; the driver never sends one."""
    with lockstep() as both:
        both.wait(3.0)
        both.wait(1.0, (0.3, 0.0))
        both.wait(2.5, (math.nan, 0.0))
        assert "come from the autopilot" in both.lost
