"""Frames against bytes packed by hand, damage of every kind, and a real vehicle's recorded link."""

import struct
from collections import Counter, defaultdict
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega

from drivers.rover_serial.autopilots import ARDUPILOT, PX4
from drivers.rover_serial.frames import Framer, SequenceCounter
from drivers.rover_serial.messages import Decoder, Speaker
from tests.drivers.rover_serial.golden import ATTITUDE, COMMAND_LONG, HEARTBEAT, SET_POSITION, crc, frame, heartbeat

RECORDED = Path(__file__).parents[2] / "data" / "vehicle_link" / "excerpt.tlog"
# A disarmed ArduPilot rover in mode HOLD (4), system 1, component 1, sequence 78
BEAT = bytes.fromhex("fd 09 00 00 4e 01 01 00 00 00 04 00 00 00 0a 03 01 04 03") + b"\x00\x00"
KEY = bytes(range(32))


def records():
    data, at = RECORDED.read_bytes(), 0
    while at < len(data):
        size = 12 + data[at + 9] + 13 * (data[at + 10] & 1)
        yield data[at + 8 : at + 8 + size]
        at += 8 + size


def spoken(act, key=None, timestamp=0):
    sent = []
    speaker = Speaker(255, 191, 1, sent.append)
    if key is not None:
        speaker.sign(key, timestamp)
    act(speaker)
    return sent


def test_the_hand_made_checksum_is_the_catalogues():
    assert crc(b"123456789") == 0x6F91


def test_a_heartbeat_is_read_byte_for_byte():
    whole = BEAT[:-2] + struct.pack("<H", crc(BEAT[1:-2] + b"\x32"))
    (read,) = Framer().feed(whole)
    assert (read.system, read.component, read.sequence, read.message_id, read.signed) == (1, 1, 78, 0, False)
    message = Decoder().decode(read)
    assert (message.custom_mode, message.type, message.autopilot, message.base_mode) == (4, 10, 3, 1)


def test_a_payload_whose_trailing_zeros_were_cut_off_is_whole_again():
    attitude = frame(ATTITUDE, struct.pack("<I6f", 1234, 0.0, 0.0, -0.5, 0.0, 0.0, 0.0))
    assert attitude[1] == 16
    message = Decoder().decode(*Framer().feed(attitude))
    assert (message.time_boot_ms, message.yaw, message.yawspeed) == (1234, -0.5, 0.0)


def test_arming_is_asked_byte_for_byte():
    expected = frame(COMMAND_LONG, struct.pack("<7fHBBB", 1, 0, 0, 0, 0, 0, 0, 400, 1, 1, 0), system=255, component=191)
    assert spoken(lambda speaker: speaker.command(400, 0, (1.0,))) == [expected]
    again = frame(COMMAND_LONG, struct.pack("<7fHBBB", 1, 0, 0, 0, 0, 0, 0, 400, 1, 1, 2), system=255, component=191)
    assert spoken(lambda speaker: speaker.command(400, 2, (1.0,))) == [again]


@pytest.mark.parametrize(("wz", "yaw_rate"), [(0.5, -0.5), (-0.25, 0.25), (0.0, -0.0)])
def test_ardupilot_is_sent_speed_and_a_clockwise_rate(wz, yaw_rate):
    payload = struct.pack("<I11fHBBB", 7, 0, 0, 0, 0.75, 0, 0, 0, 0, 0, 0, yaw_rate, 0x5C7, 1, 1, 9)
    target = ARDUPILOT.target(0.75, wz, 5.0)
    expected = frame(SET_POSITION, payload, system=255, component=191)
    assert spoken(lambda speaker: speaker.set_point(7_999_999, ARDUPILOT, target)) == [expected]


def test_px4_is_sent_the_direction_that_its_heading_control_turns_to():
    target = PX4.target(0.5, 0.5, 5.0)  # 5 /s times 0.1 rad
    assert (target.vx_m_s, target.vy_m_s) == pytest.approx((0.4975021, -0.0499167))  # left is negative in forward-right-down
    assert PX4.target(0.0, 0.0, 5.0) == PX4.target(-0.0, 0.0, 5.0)
    assert PX4.target(0.0, 0.5, 5.0).vx_m_s > 0.0  # a velocity of nothing has no direction
    message = Decoder().decode(*Framer().feed(*spoken(lambda speaker: speaker.set_point(0, PX4, target))))
    assert (message.coordinate_frame, message.type_mask) == (8, 0xDC7)


def test_what_is_signed_is_signed_byte_for_byte_and_each_frame_later_than_the_one_before():
    sent = spoken(lambda speaker: [speaker.heartbeat(), speaker.heartbeat()], key=KEY, timestamp=1000)
    payload = struct.pack("<IBBBBB", 0, 6, 8, 0, 4, 3)
    for number in range(2):
        header = {"system": 255, "component": 191, "sequence": number}
        assert sent[number] == frame(HEARTBEAT, payload, **header, key=KEY, timestamp=1000 + number)


def test_a_mavlink_1_heartbeat_is_known_for_what_it_is():
    body = bytes((9, 5, 1, 1, 0)) + struct.pack("<IBBBBB", 0, 10, 3, 1, 4, 3)
    framer = Framer()
    good = heartbeat()
    frames = framer.feed(b"\xfe" + body + struct.pack("<H", crc(body + b"\x32")) + good)
    assert [read.raw for read in frames] == [good]
    assert framer.older == 1


@settings(max_examples=60, deadline=None)
@given(st.lists(st.one_of(st.integers(0, 255), st.binary(max_size=30)), max_size=12), st.integers(1, 40))
def test_good_frames_are_found_among_any_bytes_in_any_pieces(parts, piece):
    good = [heartbeat(sequence=part, key=KEY if part % 2 else None) for part in parts if isinstance(part, int)]
    left = iter(good)
    data = b"".join(next(left) if isinstance(part, int) else part for part in parts) + bytes(300)
    framer = Framer()
    found = [read.raw for at in range(0, len(data), piece) for read in framer.feed(data[at : at + piece])]
    assert [raw for raw in found if raw in good] == good


@given(st.integers(1, 20), st.integers(1, 255))
def test_no_bent_byte_goes_unnoticed(place, change):
    bent = bytearray(heartbeat(sequence=9))
    bent[place] ^= change
    after = heartbeat(sequence=10)
    found = Framer().feed(bytes(bent) + after + bytes(300))
    assert after in [read.raw for read in found]
    assert all(read.message_id != 0 or read.raw == after for read in found)


def test_the_frames_after_a_damaged_one_are_not_lost_with_it():
    """pymavlink's own parser takes as many bytes as the damaged header claims."""
    liar = bytearray(heartbeat(sequence=1))
    liar[1] = 60
    good = [heartbeat(sequence=number) for number in range(2, 8)]
    framer = Framer()
    assert [read.sequence for read in framer.feed(bytes(liar) + b"".join(good))] == [2, 3, 4, 5, 6, 7]
    assert framer.damaged == 1


def test_a_recorded_link_reads_as_pymavlink_reads_it():
    peer = ardupilotmega.MAVLink(None)
    peer.robust_parsing = True
    theirs = [m for raw in records() for m in peer.parse_buffer(raw) or () if m.get_type() != "BAD_DATA"]
    data = b"".join(records())
    framer, decoder = Framer(), Decoder()
    ours = [read for at in range(0, len(data), 333) for read in framer.feed(data[at : at + 333])]
    assert [read.raw for read in ours] == [bytes(m.get_msgbuf()) for m in theirs]
    assert [str(decoder.decode(read)) for read in ours] == [str(m) for m in theirs]


def test_a_recorded_link_has_gaps_where_frames_were_not_recorded():
    lost, counters = Counter(), defaultdict(SequenceCounter)
    for read in Framer().feed(b"".join(records())):
        lost[read.system, read.component] += counters[read.system, read.component].lost_before(read.sequence)
    assert lost[1, 1] == 0  # the autopilot's came all
    assert lost[1, 220] == 1
    assert lost[1, 100] == 1
