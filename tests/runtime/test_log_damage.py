"""Whatever happens to a log's bytes is noticed: in one file, in one of several, in a recording cut out of a log."""

import shutil
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from runtime.log.files.marks import END
from runtime.log.files.paths import files_of
from runtime.log.reading.cut import cut
from runtime.log.reading.read import STATIC, read_file
from tests.runtime.log_cycles import make_cycles
from tests.runtime.test_log_recorder import record

CYCLES = make_cycles(24)
Damage = Callable[[bytes], bytes]


def noticed(logs: list[Path]) -> list[str]:
    """What a verification says of each; where Rerun's reader ends the process, that is being noticed."""
    left, verdicts = list(logs), []
    while left:
        command = [sys.executable, "-m", "tests.runtime.read_damaged", *left]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
        said = done.stdout.splitlines()
        ended_early = done.returncode != 0
        verdicts += said + ["noticed"] * ended_early
        left = left[len(said) + ended_early :]
        assert said or done.returncode < 0, done.stderr
    return verdicts


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """A log of one file, a log of several, and a recording cut out of the latter."""
    folder = tmp_path_factory.mktemp("log")
    (folder / "one").mkdir()
    (folder / "several").mkdir()
    record(folder / "one" / "a.rrd", CYCLES, batch_ticks=6)
    record(folder / "several" / "a.rrd", CYCLES, batch_ticks=6, segment_mb=0.3)
    (folder / "cut").mkdir()
    cut(folder / "several" / "a.rrd", 12, 0.6, folder / "cut" / "a.rrd")
    assert len(files_of(folder / "several" / "a.rrd")) > 1
    return [folder / kind / "a.rrd" for kind in ("one", "several", "cut")]


def damaged(log: Path, folder: Path, damage: Damage) -> Path:
    """A copy of a log with the last of its files damaged."""
    folder.mkdir(parents=True)
    for file in files_of(log):
        shutil.copy(file, folder)
    last = files_of(folder / log.name)[-1]
    last.write_bytes(damage(last.read_bytes()))
    return last


def flip(at: int, bit: int) -> Damage:
    def damage(content: bytes) -> bytes:
        return content[:at] + bytes([content[at] ^ 1 << bit]) + content[at + 1 :]

    return damage


def test_what_nobody_damaged_is_whole(logs: list[Path]) -> None:
    assert noticed(logs) == ["not noticed"] * 3


def test_every_flipped_bit_is_noticed(logs: list[Path], tmp_path: Path) -> None:
    random, copies = np.random.default_rng(4), []
    for log in logs:
        file = files_of(log)[-1]
        size = int(read_file(file, END).at(END, STATIC)["bytes"][0])  # what comes after it is the mark itself
        for index in range(8):
            places = flip(int(random.integers(size)), index)
            copies.append(damaged(log, tmp_path / log.parent.name / str(index), places))
    assert noticed(copies) == ["noticed"] * len(copies)


def messages(content: bytes) -> list[int]:
    """Where each message of a recording ends: after a header of 12 bytes, each has its kind and its length before it."""
    ends = [12]
    while ends[-1] < len(content):
        _, length = struct.unpack_from("<QQ", content, ends[-1])
        ends.append(ends[-1] + 16 + length)
    assert ends[-1] == len(content)
    return ends


def test_a_cut_is_noticed_wherever_it_is(logs: list[Path], tmp_path: Path) -> None:
    copies = []
    for log in logs:
        ends = messages(files_of(log)[-1].read_bytes())
        between = [ends[0], ends[1], ends[len(ends) // 2], ends[-3], ends[-2]]
        within = [5, ends[0] + 7, ends[1] + 16, ends[len(ends) // 2] + 100, ends[-1] - 1]
        copies += [damaged(log, tmp_path / log.parent.name / str(size), cut_to(size)) for size in (*between, *within)]
    assert noticed(copies) == ["noticed"] * len(copies)


def cut_to(size: int) -> Damage:
    return lambda content: content[:size]
