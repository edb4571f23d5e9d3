"""A log in pieces replays as well: files of a set, one of them alone, a recording cut out, what a killed run leaves."""

import re
import shlex
import subprocess
import sys
import time
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from shutil import copy

import pytest

from runtime import registry
from runtime.cli import run_command
from runtime.log.files.paths import files_of
from runtime.log.reading.cut import CUT
from runtime.log.reading.read import STATIC, read
from runtime.replay.replay import ReplayOptions, replay
from tests.runtime.test_replay import record

COMMAND = "from runtime.cli import main; main()"
PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = record(tmp_path_factory.mktemp("logs") / "a.rrd", "dynamic_hallway", "log.segment_mb=0.3", seconds=3.0)
    assert len(files_of(path)) > 2
    return path


def replayed(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    """Replay; return the exit code, and what was said on one line."""
    capsys.readouterr()
    code = run_command(["replay", *map(str, arguments)])
    captured = capsys.readouterr()
    return code, " ".join((captured.out + captured.err).split())


def test_all_files_of_a_set_are_one_log(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in (log, log.with_suffix(""), files_of(log)[1]):
        assert replayed(capsys, name) == (0, "identical: 61 ticks")


def test_a_file_of_a_set_replays_alone_from_its_key_frame(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    alone = Path(copy(files_of(log)[2], tmp_path))
    code, said = replayed(capsys, alone)
    assert code == 0
    begun = re.fullmatch(r"replayed from tick (\d+) (\d+ ticks could not be .* missing )?identical: (\d+) ticks", said)
    assert begun is not None, said
    assert int(begun[1]) > 0
    code, said = replayed(capsys, alone, "--from", 0)
    assert code == 2
    assert re.search(r"--from 0: the log .* holds ticks \d+ to \d+", said)


def test_a_recording_cut_out_replays_by_the_command_in_it(
    log: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "cut.rrd"
    assert run_command(["log", "cut", str(log), "--around", "45", "--seconds", "0.5", "--output", str(cut)]) == 0
    command = shlex.split(read(cut).at(CUT, STATIC)["command"][0])
    assert command == ["trundle", "replay", "cut.rrd"]
    monkeypatch.chdir(tmp_path)
    code, said = replayed(capsys, *command[2:])
    assert code == 0
    assert re.fullmatch(r"replayed from tick \d+ identical: \d+ ticks", said)


def test_a_run_that_was_killed_replays_as_far_as_it_was_recorded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "a.rrd"
    command = [sys.executable, "-c", COMMAND, "run", "dynamic_hallway", "--log", str(log)]
    deadline_s = time.monotonic() + PATIENCE_S
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
        while not (log.is_file() and log.stat().st_size > 600_000):
            assert time.monotonic() < deadline_s
            time.sleep(0.01)
        run.kill()
    code, said = replayed(capsys, log)
    if code == 1:  # killed within a message
        assert "is cut or damaged" in said
        assert run_command(["log", "repair", str(log)]) == 0
        code, said = replayed(capsys, tmp_path / "a.repaired.rrd")
    assert code == 0
    assert re.search(r"has no end: its writer was killed, or it was cut off identical: \d\d+ ticks", said)


def test_a_planner_that_is_not_installed_is_named(
    log: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def without_dwa(part: registry.Part) -> tuple[EntryPoint, ...]:
        return tuple(entry for entry in entry_points(group=part.value) if entry.name != "dwa")

    assert replay(log, ReplayOptions(last=2)).planner == "dwa"
    monkeypatch.setattr(registry, "registered", without_dwa)
    code, said = replayed(capsys, log)
    assert code == 2
    assert "unknown planner 'dwa'" in said
