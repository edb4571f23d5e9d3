"""Emulated CAN wheel controllers, from the host's end of the bus.  Every frame is packed by hand from the published protocol."""

import math
import struct

import numpy as np
import pytest

from tests.sim_drivers.firmware.canbench import BASE, NODES, can_bench

IDLE, CLOSED_LOOP = 1, 8
FORWARD = tuple(BASE.rates_from_twist @ (0.3, 0.0, 0.0) / (2 * math.pi))  # 0.3 m/s [turn/s]


def state(payload: bytes) -> int:
    return payload[4]


def error(payload: bytes) -> int:
    return int.from_bytes(payload[:4], "little")


def test_wakes_up_idle_and_says_so_ten_times_a_second():
    with can_bench(axis={"watchdog_s": None}) as bench:
        bench.wait(1.0)
        for node in NODES:
            beats = bench.frames(node << 5 | 1)
            assert len(beats) == 10
            assert set(beats) == {bytes([0, 0, 0, 0, 1, 0, 0, 0])}  # no error, IDLE, success, trajectory not done


@pytest.mark.parametrize(
    ("version", "after_estop"),
    [
        ("0.5", "00 40 00 00 01 00 00 00"),  # ESTOP_REQUESTED = 0x4000; state; motor, encoder, controller flags
        ("0.6", "00 00 00 02 01 03 00 00"),  # ESTOP_REQUESTED = 0x02000000; state; DISARMED; trajectory; reserved
    ],
)
def test_heartbeat_of_both_firmware_generations(version, after_estop):
    with can_bench(version=version, axis={"watchdog_s": None}) as bench:
        bench.arm()
        assert bench.ask(0x81) == [bytes([0, 0, 0, 0, 8, 0, 0, 0])]
        bench.send(0x82)  # node 4, Estop
        bench.wait(0.01)
        assert bench.ask(0x81) == [bytes.fromhex(after_estop)]
        assert state(bench.ask(0xA1)[0]) == CLOSED_LOOP  # its neighbour on the bus was not meant


def test_set_input_vel_turns_the_wheel_at_that_rate():
    """Golden: 0.5 turn/s is 00 00 00 3f in IEEE 754 single precision, little endian."""
    with can_bench() as bench:
        bench.arm()
        for _ in range(25):
            for node in NODES:
                bench.send(node << 5 | 0x0D, bytes.fromhex("00 00 00 3f 00 00 00 00"))
            bench.wait(0.02)
        for node in NODES:
            position, velocity = struct.unpack("<ff", bench.frames(node << 5 | 9)[-1])
            assert velocity == pytest.approx(0.5, abs=0.03)
            assert position == pytest.approx(0.25, abs=0.05)


def test_encoder_estimates_come_a_hundred_times_a_second_in_counts():
    with can_bench(axis={"watchdog_s": None}, encoder_counts_per_turn=1024) as bench:
        bench.arm()
        bench.drive((0.3, 0.3, 0.3), 1.0)
        positions = np.array([struct.unpack("<f", data[:4])[0] for data in bench.frames(0x89)])
        assert len(positions) == pytest.approx(101, abs=2)
        assert np.allclose(positions * 1024, np.round(positions * 1024))


def test_the_base_goes_where_the_wheels_take_it():
    with can_bench(wheel_radius_error=(0, 0, 0), wheel_heading_error_rad=(0, 0, 0)) as bench:
        bench.arm()
        bench.drive(FORWARD, 2.0)
        x, y, _ = bench.world.data.body("base").xpos
        assert x == pytest.approx(0.6, abs=0.05)
        assert abs(y) < 0.03


def test_without_velocity_control_it_holds_its_place():
    with can_bench() as bench:
        for node in NODES:
            bench.send(node << 5 | 0x18, b"\0")
            bench.send(node << 5 | 0x07, struct.pack("<I", CLOSED_LOOP))  # the controller is still in position control
        bench.wait(0.01)
        bench.drive((1.0, 1.0, 1.0), 0.5)
        assert bench.speed() < 0.01
        assert state(bench.ask(0x81)[0]) == CLOSED_LOOP


def test_the_watchdog_disarms_and_the_wheels_coast():
    with can_bench(axis={"watchdog_s": 0.1}, friction_nm=0.0) as bench:
        bench.arm()
        bench.drive(FORWARD, 1.0)
        bench.wait(0.3)
        beat = bench.frames(0x81)[-1]
        assert (error(beat), state(beat)) == (0x0100_0000, IDLE)
        assert bench.speed() > 0.5 * max(map(abs, FORWARD))  # nothing brakes it but the rollers' drag
        assert [axis.watchdog_trips for axis in bench.firmware.axes] == [1, 1, 1]


def test_friction_ends_the_coasting():
    with can_bench(axis={"watchdog_s": 0.1}) as bench:
        bench.arm()
        bench.drive(FORWARD, 1.0)
        bench.wait(2.0)
        assert bench.speed() < 1e-3


def test_a_request_feeds_the_watchdog_too():
    """As in firmware 0.5.6: whoever polls keeps the wheels turning, so a driver must not."""
    with can_bench(axis={"watchdog_s": 0.1}) as bench:
        bench.arm()
        bench.drive(FORWARD, 0.2)
        for _ in range(50):
            for node in NODES:
                bench.send(node << 5 | 0x17, remote=True)
            bench.wait(0.02)
        assert bench.speed() > 0.9 * max(map(abs, FORWARD))


@pytest.mark.parametrize("version", ["0.5", "0.6"])
def test_a_disarmed_axis_arms_only_after_its_errors_are_cleared(version):
    with can_bench(version=version, axis={"watchdog_s": 0.1}) as bench:
        bench.wait(0.5)  # expired while idle
        bench.send(0x87, struct.pack("<I", CLOSED_LOOP))
        bench.wait(0.01)
        beat = bench.ask(0x81)[0]
        assert error(beat) != 0
        assert state(beat) == IDLE
        bench.arm()
        assert (error(beat := bench.ask(0x81)[0]), state(beat)) == (0, CLOSED_LOOP)


def test_a_ramp_limits_the_acceleration():
    with can_bench(axis={"ramp_turns_s2": 2.0}) as bench:
        bench.arm()
        for node in NODES:
            bench.send(node << 5 | 0x0B, struct.pack("<II", 2, 2))  # velocity control, VEL_RAMP
        bench.drive((1.0, 1.0, 1.0), 0.25)
        assert bench.speed() == pytest.approx(0.5, abs=0.06)
        bench.drive((1.0, 1.0, 1.0), 0.5)
        assert bench.speed() == pytest.approx(1.0, abs=0.03)


def test_torque_is_limited():
    """A drive that has hardly more than its friction to give gathers speed slowly."""
    with can_bench(torque_nm=0.2) as strong, can_bench(torque_nm=0.12) as weak:
        for bench in (strong, weak):
            bench.arm()
            bench.drive(FORWARD, 0.2)
        assert weak.speed() < 0.7 * strong.speed()


def test_velocity_is_cut_to_the_limit_and_set_limits_moves_it():
    with can_bench(axis={"velocity_limit_turns_s": 0.5}) as bench:
        bench.arm()
        bench.drive((3.0, 3.0, 3.0), 0.6)
        assert bench.speed() == pytest.approx(0.5, abs=0.03)
        for node in NODES:
            bench.send(node << 5 | 0x0F, struct.pack("<ff", 0.8, 10.0))
        bench.drive((3.0, 3.0, 3.0), 0.6)
        assert bench.speed() == pytest.approx(0.8, abs=0.03)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_set_point_that_is_no_number_disarms(bad):
    with can_bench() as bench:
        bench.arm()
        bench.drive((bad, 0.0, 0.0), 0.02)
        assert state(bench.ask(0x81)[0]) == IDLE
        assert state(bench.ask(0xA1)[0]) == CLOSED_LOOP


def test_motors_may_turn_the_other_way_round_and_faster_than_the_wheels():
    wire = {"signs": (-1, -1, -1), "gear_ratio": 4.0}
    with can_bench(wire=wire, axis={"velocity_limit_turns_s": 20.0}, wheel_radius_error=(0, 0, 0)) as bench:
        bench.arm()
        bench.drive(tuple(-4.0 * rate for rate in FORWARD), 2.0)
        assert bench.world.data.body("base").xpos[0] == pytest.approx(0.6, abs=0.05)
        estimates = [struct.unpack("<ff", bench.frames(node << 5 | 9)[-1]) for node in NODES]
        assert [velocity for _, velocity in estimates] == pytest.approx([-4.0 * rate for rate in FORWARD], abs=0.1)


def test_answers_requests_of_its_own_version_only():
    with can_bench(version="0.6") as new, can_bench(version="0.5") as old:
        assert new.ask(0x80)[0][:1] == b"\x02"  # protocol version 2
        assert new.ask(0x80)[0][4:7] == bytes([0, 6, 10])
        assert old.ask(0x80) == []
        volts, amperes = struct.unpack("<ff", new.ask(0x97)[0])
        assert 24.0 < volts < 25.0
        assert 0.05 < amperes < 0.2
        assert struct.unpack("<ff", new.ask(0x95)[0]) == (25.0, 25.0)
        assert old.ask(0x95) == []
        assert len(old.ask(0x8A)[0]) == 8  # Get_Encoder_Count


def test_an_empty_data_frame_is_a_request_too():
    with can_bench(axis={"watchdog_s": None}, bus_ms=0) as bench:
        bench.send(0x97)
        bench.wait(0.01)
        assert len(bench.frames(0x97)) == 1


def test_a_frame_for_nobody_or_too_short_does_nothing():
    with can_bench() as bench:
        bench.send(0x07 | 40 << 5, struct.pack("<I", CLOSED_LOOP))
        bench.send(0x87, b"\x08")
        bench.wait(0.05)
        assert state(bench.ask(0x81)[0]) == IDLE


def test_driving_costs_current_and_lowers_the_voltage():
    with can_bench() as bench:
        bench.arm()
        rest_v, rest_a = struct.unpack("<ff", bench.ask(0x97)[0])
        bench.drive(tuple(3.0 * v for v in FORWARD), 0.1)  # accelerating
        volts, amperes = struct.unpack("<ff", bench.ask(0x97)[0])
        assert amperes > rest_a
        assert volts < rest_v


@pytest.mark.parametrize(
    ("fault", "check"),
    [
        ({"kind": "silent", "node": 4}, lambda four, five: four == [] and five != []),
        ({"kind": "freeze", "node": 4}, lambda four, five: len(set(four)) == 1 and len(set(five)) > 5),
        ({"kind": "nan", "node": 4}, lambda four, five: all(math.isnan(struct.unpack("<f", d[:4])[0]) for d in four)),
        ({"kind": "out_of_range", "node": 4}, lambda four, five: all(struct.unpack("<f", d[:4])[0] > 1e9 for d in four)),
        ({"kind": "wrong_node", "node": 4}, lambda four, five: four == [] and five != []),
        ({"kind": "drop", "node": 4, "probability": 0.5}, lambda four, five: 0.2 * len(five) < len(four) < 0.8 * len(five)),
        ({"kind": "truncate", "node": 4, "probability": 1.0}, lambda four, five: all(len(d) < 8 for d in four)),
        ({"kind": "corrupt", "node": 4, "probability": 1.0}, lambda four, five: len(set(four)) == len(four)),
    ],
)  # fmt: skip
def test_a_script_makes_it_misbehave_in_its_window_only(fault, check):
    with can_bench(faults=({"from_s": 1.0, "until_s": 2.0} | fault,), axis={"watchdog_s": None}) as bench:
        bench.arm()
        bench.drive(FORWARD, 0.9)
        assert all(abs(struct.unpack("<f", d[:4])[0]) < 10.0 for d in bench.frames(0x89))
        bench.drive(FORWARD, 0.2)
        bench.forget()
        bench.drive(FORWARD, 0.5)
        assert check(bench.frames(0x89), bench.frames(0xA9))
        bench.drive(FORWARD, 0.5)
        bench.forget()
        bench.drive(FORWARD, 0.2)
        assert len(set(bench.frames(0x89))) > 5


def test_by_script_it_is_deaf_floods_the_bus_and_faults_once():
    script = (
        {"kind": "deaf", "node": 4, "until_s": 0.5},
        {"kind": "flood", "until_s": 0.5},
        {"kind": "drive", "node": 5, "from_s": 1.0},
    )
    with can_bench(faults=script, axis={"watchdog_s": None}) as bench:
        bench.arm()
        bench.wait(0.5)
        assert state(bench.frames(0x81)[-1]) == IDLE
        assert state(bench.frames(0xA1)[-1]) == CLOSED_LOOP
        assert len(bench.frames(63 << 5 | 0x1F)) == pytest.approx(1000, rel=0.02)
        bench.wait(0.6)
        assert error(bench.frames(0xA1)[-1]) == 0x20
        bench.arm()
        bench.wait(0.2)
        assert state(bench.frames(0xA1)[-1]) == CLOSED_LOOP  # once only


def test_a_reboot_leaves_it_idle_and_counts_from_where_the_wheel_stands():
    with can_bench(axis={"watchdog_s": None}) as bench:
        bench.arm()
        bench.drive(FORWARD, 1.0)
        assert abs(struct.unpack("<f", bench.frames(0x89)[-1][:4])[0]) > 0.1
        bench.send(0x96, b"\0")
        bench.wait(0.03)
        assert abs(struct.unpack("<f", bench.frames(0x89)[-1][:4])[0]) < 0.1
        assert state(bench.ask(0x81)[0]) == IDLE


def test_the_same_seed_puts_the_same_bytes_on_the_bus():
    def heard(seed: int) -> list[tuple[int, bytes]]:
        with can_bench(seed=seed, loss_probability=0.05) as bench:
            bench.arm()
            bench.drive(FORWARD, 0.5)
            return [(message.arbitration_id, bytes(message.data)) for message in bench.heard]

    assert heard(1) == heard(1)
    assert heard(1) != heard(2)


def test_a_closed_one_leaves_the_bus_and_comes_back():
    with can_bench(axis={"watchdog_s": None}) as bench:
        bench.firmware.close()
        bench.firmware.close()
        bench.wait(0.3)
        assert bench.heard == []
        bench.firmware.open()
        bench.wait(0.3)
        assert bench.heard
