"""Golden frames: packed by hand from ODrive's CAN protocol document, so that an error in our tables cannot hide."""

import math
import pickle
from pathlib import Path

import cantools
import pytest
from hypothesis import given
from hypothesis import strategies as st

import drivers.omni_can
from drivers.interface.errors import ConfigurationError
from drivers.omni_can.bus_load import LoadMeter, frame_bits
from drivers.omni_can.dbc import load_codec

FOLDER = Path(drivers.omni_can.__file__).parent
DATABASES = {name: cantools.database.load_file(FOLDER / f"cansimple_0_{name[-1]}.dbc") for name in ("0.5", "0.6")}
# message, firmware, command, payload, values in the order of the document
GOLDEN = [
    ("Heartbeat", "0.5", 0x01, "00 08 00 00 01 01 00 80", (0x800, 1, 1, 0, 0, 1)),  # watchdog; idle; motor error; trajectory done
    ("Heartbeat", "0.5", 0x01, "01 00 00 00 08 00 01 01", (1, 8, 0, 1, 1, 0)),  # encoder and controller flags
    ("Heartbeat", "0.6", 0x01, "00 00 00 01 01 03 00 00", (0x01000000, 1, 3, 0)),  # watchdog; idle; disarmed
    ("Heartbeat", "0.6", 0x01, "00 00 00 00 08 00 01 00", (0, 8, 0, 1)),
    ("Get_Encoder_Estimates", "0.6", 0x09, "00 00 20 41 00 00 00 bf", (10.0, -0.5)),
    ("Get_Bus_Voltage_Current", "0.5", 0x17, "00 00 c0 41 00 00 80 3e", (24.0, 0.25)),
    ("Get_Temperature", "0.6", 0x15, "00 00 0c 42 00 00 a0 41", (35.0, 20.0)),
    ("Get_Version", "0.6", 0x00, "02 05 02 00 00 06 0a 00", (2, 5, 2, 0, 0, 6, 10, 0)),
    ("Set_Axis_State", "0.6", 0x07, "08 00 00 00", (8,)),
    ("Set_Controller_Mode", "0.5", 0x0B, "02 00 00 00 02 00 00 00", (2, 2)),
    ("Set_Input_Vel", "0.5", 0x0D, "00 00 c0 3f 00 00 00 00", (1.5, 0.0)),
    ("Clear_Errors", "0.6", 0x18, "00", (0,)),
    ("Clear_Errors", "0.5", 0x18, "", ()),
]


@pytest.mark.parametrize(("name", "firmware", "command", "payload", "values"), GOLDEN)
def test_golden_frames_both_ways(name, firmware, command, payload, values):
    message = load_codec(firmware)[name]
    data = bytes.fromhex(payload).ljust(message.length, b"\0")
    assert message.command == command
    assert message.decode(data) == values
    assert message.encode(*values) == data
    assert pickle.loads(pickle.dumps(message)).decode(data) == values


@given(st.binary(min_size=8, max_size=8), st.sampled_from(["0.5", "0.6"]))
def test_whatever_comes_decodes_as_cantools_decodes_it(data, firmware):
    database = DATABASES[firmware]
    for name, message in load_codec(firmware).items():
        payload = data[: message.length]
        theirs = database.get_message_by_name(name).decode(payload, decode_choices=False)
        for signal, ours in zip(message.signals, message.decode(payload), strict=True):
            assert ours == theirs[signal.name] or (math.isnan(ours) and math.isnan(theirs[signal.name]))


def test_a_dbc_of_ones_own_may_name_its_axis_and_must_be_whole(tmp_path):
    text = (FOLDER / "cansimple_0_6.dbc").read_text()
    own = tmp_path / "own.dbc"
    own.write_text(text.replace("BO_ 9 Get_", "BO_ 9 Axis0_Get_"))
    assert load_codec("0.6", own)["Get_Encoder_Estimates"].command == 9
    own.write_text(text.replace("Set_Input_Vel", "Set_Input_Speed"))
    with pytest.raises(ConfigurationError, match=r"own\.dbc has no message Set_Input_Vel"):
        load_codec("0.6", own)
    own.write_text(text.replace("Vel_Estimate", "Speed"))
    with pytest.raises(ConfigurationError, match=r"Get_Encoder_Estimates of .* has no signal Vel_Estimate"):
        load_codec("0.6", own)
    own.write_text(text.replace("SG_ Bus_Voltage : 0|32@1- (1,0)", "SG_ Bus_Voltage : 0|32@1- (0.5,0)"))
    with pytest.raises(ConfigurationError, match=r"Get_Bus_Voltage_Current\.Bus_Voltage is not plain"):
        load_codec("0.6", own)
    own.write_text("BO_ nonsense")
    with pytest.raises(ConfigurationError, match=r"own\.dbc cannot be read"):
        load_codec("0.6", own)
    with pytest.raises(ConfigurationError, match=r"missing\.dbc cannot be read"):
        load_codec("0.6", tmp_path / "missing.dbc")


def test_the_load_of_a_bus_by_hand():
    """8 bytes: 47 fixed bits, 64 of data, and a stuff bit in four of the 98 that are stuffed: (98 - 1) // 4 = 24."""
    assert frame_bits(8) == 47 + 64 + 24
    meter = LoadMeter(500_000)
    meter.update(0)
    for _ in range(360):
        meter.add(8)
    meter.update(1_000_000_000)
    assert meter.load == pytest.approx(360 * 135 / 500_000)
