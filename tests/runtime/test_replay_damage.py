"""A log that was damaged is said to be, and never ends the process that replays it."""

from pathlib import Path

import numpy as np
import pytest

from runtime.cli import run_command
from runtime.log.seal import Seal, seal_of
from tests.runtime.log_cycles import make_cycles
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


def test_of_a_truncated_log_the_first_missing_tick_is_named(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "a.rrd"
    cut.write_bytes(log.read_bytes()[: int(0.7 * log.stat().st_size)])
    assert run_command(["replay", str(cut)]) == 1
    said = capsys.readouterr().out
    assert "is cut or damaged" in said
    first = int(said.rsplit("the first tick that is damaged or missing is ", 1)[1])
    assert 0 < first < 31
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
