"""The session on a bus whose both ends the test holds: every frame by hand, every moment by the test's clock."""

import struct

import numpy as np
import pytest

from drivers.interface.devices import DeviceState
from drivers.interface.errors import DeviceError
from tests.drivers.omni_can.fake_bus import CLOSED, NODES, Driven

TRIPPED = "00 00 00 01 01 03 00 00"  # watchdog timer expired; idle; disarmed
ZERO = bytes(8)
ARMING = [
    frame
    for node in NODES
    for frame in ((node << 5 | 0x18, b"\0", False), (node << 5 | 0x0B, bytes.fromhex("02 00 00 00 01 00 00 00"), False))
]
ZEROS = [(node << 5 | 0x0D, ZERO, False) for node in NODES]
CLOSED_LOOP = [(node << 5 | 0x07, b"\x08\0\0\0\0\0\0\0", False) for node in NODES]


def ready(**settings):
    driven = Driven(verify_watchdog=False, **settings)
    driven.hear()
    driven.poll()
    driven.bus.take()
    return driven


def rates(sent):
    return [struct.unpack("<f", data[:4])[0] for identifier, data, _ in sent if identifier & 0x1F == 0x0D]


def test_it_asks_for_the_version_and_nothing_else_until_everyone_was_heard():
    driven = Driven(firmware="auto", verify_watchdog=False)
    assert driven.bus.take() == [(node << 5, b"", True) for node in NODES]
    for node in NODES[:2]:
        driven.bus.put(node << 5 | 1, "00 00 00 00 01 00 00 00")
        driven.bus.put(node << 5 | 9, "00 00 00 00 00 00 00 00")
    driven.poll(500)
    assert driven.health.state is DeviceState.RECONNECTING
    assert driven.bus.take() == []
    with pytest.raises(DeviceError, match=r"base: axis 3 \(node 5\) cannot be heard on socketcan can0"):
        driven.poll(2500)


@pytest.mark.parametrize(
    ("answers", "protocol", "firmware"), [(True, "CANSimple 0.6", "0.6.10"), (False, "CANSimple 0.5", "0.5")]
)
def test_it_finds_out_which_firmware_answers(answers, protocol, firmware):
    driven = Driven(firmware="auto", verify_watchdog=False)
    if answers:
        for node in NODES:
            driven.bus.put(node << 5, "02 05 02 00 00 06 0a 00")
    driven.hear()
    driven.poll()
    driven.hear()
    driven.poll(310)
    assert (driven.is_open, driven.health.protocol, driven.health.firmware) == (True, f"CANSimple {firmware[:3]}", firmware)


def test_what_the_encoders_said_before_the_firmware_was_known_makes_no_sample():
    """An encoder frame that overtakes the answer to Get_Version belongs to axes that are forgotten with the answer."""
    driven = Driven(firmware="auto", verify_watchdog=False)
    driven.bus.put(NODES[2] << 5 | 9, "00 00 00 00 00 00 80 3f")
    driven.bus.put(NODES[2] << 5, "02 05 02 00 00 06 0a 00")
    for node in NODES[:2]:
        driven.bus.put(node << 5 | 9, "00 00 00 00 00 00 00 40")
    driven.poll()
    assert len(driven.samples()) == 0
    driven.bus.put(NODES[2] << 5 | 9, "00 00 00 00 00 00 00 40")
    driven.poll(10)
    (sample,) = driven.samples()
    assert sample["turns_s"].tolist() == [2.0, 2.0, 2.0]


def test_every_watchdog_trips_once_before_it_is_open_and_only_while_it_is_silent():
    driven = Driven()
    driven.hear(TRIPPED)  # it has tripped before, which proves nothing
    driven.poll()
    assert driven.bus.take()[3:] == ARMING + ZEROS + CLOSED_LOOP
    driven.poll(30)
    assert driven.bus.take() == ZEROS
    driven.hear(CLOSED)
    driven.poll(20)
    driven.bus.take()
    driven.hear(CLOSED)
    driven.poll(100)
    assert not driven.is_open
    driven.hear(TRIPPED)
    driven.poll(100)
    assert driven.is_open
    assert driven.bus.take() == []


def test_a_watchdog_that_does_not_trip_is_a_fault_that_names_the_axis():
    driven = Driven()
    driven.hear()
    driven.poll()
    driven.hear(CLOSED)
    driven.poll(50)
    driven.bus.take()
    for _ in range(9):
        driven.hear(None)
        driven.bus.put(NODES[0] << 5 | 1, TRIPPED)
        driven.poll(100)
    assert driven.health.state is DeviceState.FAULTED
    assert driven.health.fault == "base: the watchdog of axis 2 (node 4) did not trip within 0.4 s; is it enabled?"
    assert {data for identifier, data, _ in driven.bus.take() if identifier & 0x1F == 7} == {b"\x01" + bytes(7)}  # idle


def test_the_first_command_arms_and_only_then_the_wheels_turn():
    driven = ready()
    driven.command((0.5, -0.5, 1.0))
    assert driven.bus.take() == ARMING + ZEROS + CLOSED_LOOP
    driven.command((0.5, -0.5, 1.0))
    assert driven.bus.take() == ZEROS
    driven.hear(CLOSED)
    driven.poll()  # what it was told holds still
    assert driven.bus.take() == [
        (NODES[0] << 5 | 0x0D, bytes.fromhex("00 00 00 3f 00 00 00 00"), False),
        (NODES[1] << 5 | 0x0D, bytes.fromhex("00 00 00 bf 00 00 00 00"), False),
        (NODES[2] << 5 | 0x0D, bytes.fromhex("00 00 80 3f 00 00 00 00"), False),
    ]
    driven.poll(5)
    assert driven.bus.take() == []  # the same command is not sent again


def test_an_axis_that_will_not_arm_is_a_fault_with_its_error():
    driven = ready()
    driven.command((0.5, 0.5, 0.5))
    for _ in range(11):
        driven.hear(CLOSED)
        driven.bus.put(NODES[2] << 5 | 1, "20 00 00 00 01 03 00 00")  # DRV_FAULT
        driven.poll(100)
    assert driven.health.fault == "base: axis 3 (node 5) cannot be armed: DRV_FAULT"


def test_after_the_last_command_zero_is_repeated_for_a_while_and_then_nothing():
    driven = ready().driving()
    driven.command((0.5, 0.5, 0.5))
    driven.bus.take()
    times_ms = []
    for _ in range(1000):
        if driven.now_ns % 100_000_000 == 0:
            driven.hear(CLOSED)
        driven.poll(1)
        if sent := driven.bus.take():
            assert sent == ZEROS
            times_ms.append(driven.now_ns // 1_000_000)
    assert times_ms[0] == 100
    assert np.diff(times_ms).max() <= 22
    assert times_ms[-1] <= 100 + 500 + 20
    assert driven.health.expired_commands == 1


@pytest.mark.parametrize(
    ("firmware", "beat", "error"),
    [
        ("0.6", TRIPPED, "WATCHDOG_TIMER_EXPIRED"),
        ("0.6", "00 02 00 20 01 03 00 00", "DC_BUS_UNDER_VOLTAGE, bit 29"),
        ("0.5", "00 08 00 00 01 00 00 00", "WATCHDOG_TIMER_EXPIRED"),
        ("0.5", "40 00 00 00 01 01 00 00", "MOTOR_FAILED, MOTOR_ERROR"),
        ("0.5", "00 00 00 00 01 00 00 00", "IDLE"),
    ],
)
def test_an_axis_that_disarms_is_named_with_its_error_and_waits_for_the_operator(firmware, beat, error):
    driven = ready(firmware=firmware).driving()
    driven.command((0.5, 0.5, 0.5))
    driven.bus.take()
    driven.bus.put(NODES[1] << 5 | 1, beat)
    driven.poll()
    assert driven.health.state is DeviceState.FAULTED
    assert driven.health.fault == f"base: axis 2 (node 4) has disarmed: {error}"
    assert driven.bus.take() == ZEROS  # the others are told to stand
    driven.command((0.5, 0.5, 0.5))
    assert driven.bus.take() == []
    driven.session.clear_faults()
    assert driven.is_open
    driven.command((0.5, 0.5, 0.5))
    assert driven.bus.take()[-3:] == CLOSED_LOOP


def test_what_was_lost_and_is_back_arms_only_after_the_operators_reset():
    driven = Driven(reopened=True)
    driven.hear()
    driven.poll()
    assert driven.health.state is DeviceState.FAULTED
    driven.command((0.5, 0.5, 0.5))
    assert CLOSED_LOOP[0] not in driven.bus.take()
    driven.session.clear_faults()
    driven.command((0.5, 0.5, 0.5))
    assert driven.bus.take()[-3:] == CLOSED_LOOP


def test_a_silent_axis_is_a_lost_wire():
    driven = ready()
    for _ in range(30):
        for node in (NODES[0], NODES[2]):
            driven.bus.put(node << 5 | 9, ZERO)
        driven.poll(10)
    with pytest.raises(DeviceError, match=r"axis 2 \(node 4\) cannot be heard"):
        driven.poll(10)


def test_samples_carry_the_newest_frames_time_and_all_wheels_at_that_time():
    driven = ready()
    driven.samples()
    for index, node in enumerate(NODES):
        driven.bus.put(node << 5 | 9, np.array([0.02, 2.0], "<f4").tobytes(), age_ns=(3 - index) * 1_000_000)
    driven.poll(10)
    (sample,) = driven.samples()
    assert (sample["captured_ns"], sample["received_ns"]) == (9_000_000, 10_000_000)
    assert sample["turns"] == pytest.approx([0.024, 0.022, 0.020], abs=1e-6)
    assert sample["turns_s"].tolist() == [2.0, 2.0, 2.0]


def test_a_lost_frame_is_a_gap_in_the_sequence():
    driven = ready()
    driven.hear(None)
    driven.poll(10)
    for node in NODES[:2]:
        driven.bus.put(node << 5 | 9, ZERO)
    driven.poll(10)
    driven.hear(None)
    driven.poll(10)
    sequence = driven.samples()["sequence"]
    assert np.diff(sequence).tolist()[-1] == 2
    assert driven.health.dropped == 1


@pytest.mark.parametrize(
    ("command", "payload"),
    [
        (0x09, "00 00 c0 7f 00 00 00 00"),  # NaN turns
        (0x09, "00 00 00 00 00 00 80 7f"),  # infinitely fast
        (0x09, "00 00 00 00 00 00 c8 42"),  # 100 turns a second
        (0x09, "00 00 c8 42 00 00 00 00"),  # 100 turns away from where it was
        (0x09, "00 00 00 00 00 00 00"),  # too short
        (0x01, "00 00 00 00 63 00 00 00"),  # no such state
        (0x17, "00 00 c0 7f 00 00 00 00"),
        (0x17, "00 00 80 c1 00 00 00 00"),  # -16 V
    ],
)
def test_what_cannot_be_is_dropped_and_counted(command, payload):
    driven = ready()
    driven.samples()
    driven.bus.put(NODES[0] << 5 | command, payload)
    for node in NODES[1:]:
        driven.bus.put(node << 5 | 9, ZERO)
    driven.poll(10)
    assert driven.health.dropped == 1
    assert driven.samples().size == 0


def test_foreign_frames_are_counted_and_ignored():
    driven = ready()
    received = driven.health.received
    driven.bus.put(9 << 5 | 1, CLOSED)  # a node that is not ours
    driven.bus.put(NODES[0] << 5 | 0x0D, ZERO)  # another master
    driven.bus.put(NODES[0] << 5 | 1, CLOSED, plain=False)  # extended, remote or an error frame
    driven.poll()
    assert (driven.health.foreign, driven.health.received) == (3, received)
    assert not any(axis.is_closed_loop for axis in driven.session._axes.each)


def test_an_axis_that_counts_anew_goes_on_from_where_it_was():
    driven = ready()
    for turns in (0.0, 0.01, 0.02):
        driven.hear(None, turns, 1.0)
        driven.poll(10)
    for turns in (50.0, 50.01, 50.02):
        driven.hear(None, turns, 1.0)
        driven.poll(10)
    assert driven.samples()["turns"][:, 0].tolist() == pytest.approx([0.0, 0.0, 0.01, 0.02, 0.02, 0.03], abs=1e-5)


def test_the_same_position_again_and_again_of_a_turning_wheel_is_no_news():
    driven = ready()
    driven.samples()
    for _ in range(20):
        driven.hear(None, 0.01, 1.0)
        driven.poll(10)
    assert len(driven.samples()) <= 6


def test_battery_and_temperature_are_told():
    driven = ready(battery_empty_v=20.0, battery_full_v=25.0)
    for node, voltage in zip(NODES, (24.0, 23.0, 0.5), strict=True):  # of one battery; the last one is damaged
        driven.bus.put(node << 5 | 0x17, np.array([voltage, 0.5], "<f4").tobytes())
        driven.bus.put(node << 5 | 0x15, np.array([40.0, 30.0], "<f4").tobytes())
    driven.poll()
    assert (driven.health.battery_v, driven.health.battery_fraction) == (23.0, pytest.approx(0.6))
    assert driven.health.figures[:3] == [40.0, 40.0, 40.0]


def test_it_leaves_standing_axes_disarmed_and_rolling_ones_to_brake():
    driven = ready().driving()
    driven.session.close()
    assert {data[0] for identifier, data, _ in driven.bus.take() if identifier & 0x1F == 7} == {1}
    assert driven.bus.closed
    driven.session.close()
    rolling = ready().driving()
    rolling.hear(CLOSED, 0.01, 1.0)
    rolling.poll(10)
    rolling.session.rest()
    rolling.session.close()
    assert rolling.bus.take() == ZEROS
