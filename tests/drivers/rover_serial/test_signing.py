"""Signatures: the document's rules, one by one."""

import pytest

from drivers.interface.errors import ConfigurationError
from drivers.rover_serial.frames import Framer
from drivers.rover_serial.signing import MINUTE, Verifier, read_key
from tests.drivers.rover_serial.golden import heartbeat

KEY, OTHER = bytes(range(32)), bytes(32)
NOW = 10 * MINUTE


@pytest.fixture
def verifier():
    return Verifier(KEY, NOW)


def accepts(verifier, **frame):
    (read,) = Framer().feed(heartbeat(**frame))
    return verifier.accepts(read)


def test_only_the_right_key_is_believed(verifier):
    assert accepts(verifier, key=KEY, timestamp=NOW)
    assert not accepts(verifier, key=OTHER, timestamp=NOW + 1)
    assert not accepts(verifier)
    assert verifier.refused == 2


def test_a_replayed_frame_is_refused(verifier):
    assert accepts(verifier, key=KEY, timestamp=NOW)
    assert not accepts(verifier, key=KEY, timestamp=NOW)
    assert not accepts(verifier, key=KEY, timestamp=NOW - 1)
    assert accepts(verifier, key=KEY, timestamp=NOW + 1)


def test_each_system_component_and_link_has_times_of_its_own(verifier):
    assert accepts(verifier, key=KEY, timestamp=NOW + 9)
    assert accepts(verifier, key=KEY, timestamp=NOW, link=2)
    assert accepts(verifier, key=KEY, timestamp=NOW, component=2)
    assert accepts(verifier, key=KEY, timestamp=NOW, system=2)
    assert not accepts(verifier, key=KEY, timestamp=NOW + 8)


def test_a_stream_that_begins_more_than_a_minute_ago_is_refused(verifier):
    assert not accepts(verifier, key=KEY, timestamp=NOW - MINUTE - 1)
    assert accepts(verifier, key=KEY, timestamp=NOW - MINUTE)


def test_the_newest_right_time_is_learnt_and_a_wrong_one_is_not(verifier):
    assert not accepts(verifier, key=OTHER, timestamp=NOW + 50)
    assert verifier.timestamp == NOW
    assert accepts(verifier, key=KEY, timestamp=NOW + 7)
    assert verifier.timestamp == NOW + 7


def test_a_forged_frame_from_the_future_does_not_shut_the_autopilot_out(verifier):
    assert accepts(verifier, key=KEY, timestamp=NOW)
    assert not accepts(verifier, key=OTHER, timestamp=NOW + 1000 * MINUTE)
    assert accepts(verifier, key=KEY, timestamp=NOW + 1)


def test_a_key_is_32_bytes_or_their_digits(tmp_path):
    file = tmp_path / "key"
    file.write_bytes(KEY)
    assert read_key(file) == KEY
    file.write_text(KEY.hex() + "\n")
    assert read_key(file) == KEY
    for content in (b"", KEY[:-1], b"not a key at all"):
        file.write_bytes(content)
        with pytest.raises(ConfigurationError, match="holds no key"):
            read_key(file)
    with pytest.raises(ConfigurationError, match="cannot be read"):
        read_key(tmp_path / "none")
