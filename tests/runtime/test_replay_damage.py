"""A log that was damaged is said to be, and never ends the process that replays it."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from runtime.cli import run_command
from runtime.log.files.seal import Seal, seal_of
from runtime.log.reading.isolated import verified
from runtime.log.reading.opening import DamagedLogError
from runtime.log.reading.rescue import without_fatal
from runtime.log.reading.verification import Verification
from runtime.replay.damage import damage_of
from tests.runtime.log_cycles import make_cycles
from tests.runtime.test_log_damage import messages
from tests.runtime.test_log_recorder import record as record_cycles
from tests.runtime.test_replay import record

TAIL = 2_000  # bytes; the mark at the end is within them


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("logs") / "a.rrd", "dynamic_hallway", seconds=1.5)


def flipped(content: bytes, at: int, bit: int) -> bytes:
    return content[:at] + bytes([content[at] ^ 1 << bit]) + content[at + 1 :]


@pytest.mark.parametrize("share", [0.1, 0.4, 0.7, 0.9])
def test_a_flipped_bit_is_said(log: Path, tmp_path: Path, share: float, capsys: pytest.CaptureFixture[str]) -> None:
    content = log.read_bytes()
    damaged = tmp_path / "a.rrd"
    damaged.write_bytes(flipped(content, int(share * len(content)), 5))
    assert run_command(["replay", str(damaged)]) == 1
    said = capsys.readouterr().out
    assert "a.rrd is not as it was written" in said or "a.rrd is damaged" in said or "a.rrd is cut or damaged" in said


def test_of_a_truncated_log_the_last_whole_tick_is_named(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cut = tmp_path / "a.rrd"
    cut.write_bytes(log.read_bytes()[: int(0.7 * log.stat().st_size)])
    assert run_command(["replay", str(cut)]) == 1
    said = capsys.readouterr().out
    assert "is cut or damaged" in said
    whole = re.search(r"its ticks are whole up to (\d+), and none after it can be read", said)
    assert whole is not None
    assert 0 < int(whole[1]) < 30
    assert not (tmp_path / "a.repaired.rrd").exists()


def test_a_seal_is_broken_by_every_flipped_bit_before_it(tmp_path: Path) -> None:
    record_cycles(tmp_path / "a.rrd", make_cycles(6))
    content = (tmp_path / "a.rrd").read_bytes()
    assert seal_of(tmp_path / "a.rrd") is Seal.WHOLE
    random = np.random.default_rng(5)
    for _ in range(60):
        (tmp_path / "b.rrd").write_bytes(flipped(content, int(random.integers(len(content) - TAIL)), int(random.integers(8))))
        assert seal_of(tmp_path / "b.rrd") is Seal.BROKEN
    for _ in range(60):  # of the mark itself: whatever is found, nothing is raised
        at = int(random.integers(len(content) - TAIL, len(content)))
        (tmp_path / "b.rrd").write_bytes(flipped(content, at, int(random.integers(8))))
        assert seal_of(tmp_path / "b.rrd") in Seal
        (tmp_path / "b.rrd").write_bytes(content[:at])
        assert seal_of(tmp_path / "b.rrd") is Seal.OPEN


def test_what_a_reader_does_not_survive_is_taken_out_and_nothing_else(log: Path, tmp_path: Path) -> None:
    content, copy = log.read_bytes(), tmp_path / "copy.rrd"
    ends = messages(content)
    fatal = [content[begin:end] for begin, end in pairwise(ends) if end - begin > 500][5:60:25]
    without_fatal(log, copy, lambda file: not any(message in file.read_bytes() for message in fatal))
    for message in fatal:
        content = content.replace(message, b"")
    assert len(fatal) == 3
    assert copy.read_bytes() == content


def test_ticks_that_are_lost_within_a_log_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rerun's reader is taken to give up on a log that lacks a message with ticks in it."""
    record_cycles(tmp_path / "a.rrd", make_cycles(24), batch_ticks=6)
    content = (tmp_path / "a.rrd").read_bytes()
    checks = [(begin, end) for begin, end in pairwise(messages(content)) if b"/replay/check" in content[begin:end]]
    begin, end = checks[1]
    (tmp_path / "a.rrd").write_bytes(content[:begin] + content[end:])

    def gives_up(path: Path) -> Verification:
        if path.name == "a.rrd":
            raise DamagedLogError("gave up")
        return verified(path)

    monkeypatch.setattr("runtime.replay.damage.verified", gives_up)
    (sentence,) = damage_of(tmp_path / "a.rrd").sentences
    assert sentence == "gave up; tick 6 is the first that is damaged or missing"
