"""`trundle log`: what it says, what it refuses, and that nothing is overwritten."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from runtime.cli import run_command
from runtime.faults import Fault, FaultReport, Response
from runtime.log.drawn.events import EVENTS
from runtime.log.files.paths import files_of
from runtime.log.files.stops import Stops
from runtime.log.header import SCHEMA_VERSION
from runtime.log.reading.cut import CUT
from runtime.log.reading.read import STATIC, read
from runtime.log.reading.verification import verify
from runtime.log.settings import LogSettings
from tests.runtime.log_cycles import bits, make_cycles
from tests.runtime.test_log_read import foreign
from tests.runtime.test_log_recorder import record

CYCLES = make_cycles(60)
NOBODY = 65534
STOP = (FaultReport(Fault.EMERGENCY_STOP, "operator"),)
LATCHED = [
    replace(c, verdict=replace(c.verdict, faults=STOP, response=Response.LATCH)) if 20 <= i < 30 or i >= 50 else c
    for i, c in enumerate(CYCLES)
]


def trundle(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    """Run a command; return its exit code, its output on one line, and its errors."""
    code = run_command([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return code, " ".join(captured.out.split()), captured.err


def test_a_whole_log_is_described_verified_and_cut(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record(tmp_path / "a.rrd", CYCLES, batch_ticks=7)
    code, said, _ = trundle(capsys, "log", "info", tmp_path / "a.rrd")
    assert code == 0
    for words in (
        "hallway, dwa, seed 3",
        "60: 0 to 59, 3.0 s",
        f"schema {SCHEMA_VERSION}",
        "tick 30 fault: silent_device of camera",
    ):
        assert words in said
    assert trundle(capsys, "log", "verify", tmp_path / "a.rrd")[0] == 0
    code, said, _ = trundle(capsys, "log", "cut", tmp_path / "a.rrd", "--around", 40, "--seconds", 0.5)
    assert code == 0
    assert f"trundle replay {tmp_path / 'a.cut-40.rrd'}" in said
    assert trundle(capsys, "log", "verify", tmp_path / "a.cut-40.rrd")[0] == 0


def test_a_cut_holds_what_the_log_holds_of_these_ticks_and_what_is_still_drawn(tmp_path: Path) -> None:
    record(tmp_path / "a.rrd", CYCLES, segment_mb=0.4, batch_ticks=5)
    whole = read(tmp_path / "a.rrd")
    assert run_command(["log", "cut", str(tmp_path / "a"), "--around", "40", "--seconds", "0.5"]) == 0
    found = read(tmp_path / "a.cut-40.rrd")
    assert found.ticks == list(range(46))  # back to the first tick, as there is no key frame to begin with
    for entity in (name for name in whole.entities if name.startswith("/replay")):
        for name in whole.entities[entity]:
            for tick, cell in found.history(entity, name).items():
                assert bits(tuple(cell)) == bits(tuple(whole.history(entity, name)[tick]))
    assert set(whole.entities) - set(found.entities) == {"/run/segment"}
    said = found.at(CUT, STATIC)
    assert (said["around"][0], said["command"]) == (40, ["trundle replay a.cut-40.rrd"])
    assert "replay it with `trundle replay a.cut-40.rrd`" in str(found.history(EVENTS, "TextLog:text")[0])


def test_a_tick_that_the_log_does_not_hold_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record(tmp_path / "a.rrd", CYCLES[:9])
    code, _, complaint = trundle(capsys, "log", "cut", tmp_path / "a.rrd", "--around", 99)
    assert code == 2
    assert "--around 99" in complaint
    assert "holds ticks 0 to 8, not this one" in complaint
    assert not (tmp_path / "a.cut-99.rrd").exists()


def test_a_cut_log_is_repaired_beside_it_and_nothing_is_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record(tmp_path / "a.rrd", CYCLES, batch_ticks=5)
    content = (tmp_path / "a.rrd").read_bytes()[:-90_000]
    (tmp_path / "a.rrd").write_bytes(content)
    code, _, complaint = trundle(capsys, "log", "verify", tmp_path / "a.rrd")
    assert code == 2
    assert f"`trundle log repair {tmp_path / 'a.rrd'}` saves what can be read" in " ".join(complaint.split())
    code, said, _ = trundle(capsys, "log", "repair", tmp_path / "a.rrd")
    assert code == 0
    assert "a.repaired.rrd: " in said
    code, said, _ = trundle(capsys, "log", "verify", tmp_path / "a.repaired.rrd")
    assert code == 1
    assert "has no end: its writer was killed, or it was cut off" in said
    for verb in (("repair",), ("cut", "--around", "2")):
        target = tmp_path / ("a.repaired.rrd" if verb == ("repair",) else "a.rrd")
        code, _, complaint = trundle(capsys, "log", verb[0], tmp_path / "a.repaired.rrd", *verb[1:], "--output", target)
        assert code == 2
        assert f"{target} exists already; nothing is overwritten" in " ".join(complaint.split())
    assert (tmp_path / "a.rrd").read_bytes() == content


@pytest.mark.parametrize("verb", [("info",), ("verify",), ("repair",), ("cut", "--around", "3")])
def test_what_is_no_log_is_refused_in_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: tuple[str, ...]
) -> None:
    (tmp_path / "empty.rrd").touch()
    (tmp_path / "text.rrd").write_text("not a recording")
    (tmp_path / "folder.rrd").mkdir()
    foreign(tmp_path / "foreign.rrd")
    before = sorted(tmp_path.iterdir())
    for name in ("none.rrd", "empty.rrd", "text.rrd", "folder.rrd", "foreign.rrd"):
        code, _, complaint = trundle(capsys, "log", verb[0], tmp_path / name, *verb[1:])
        assert code == 2
        assert complaint.startswith("error: ")
        assert len(complaint.splitlines()) == 1
        assert name in complaint
    assert sorted(tmp_path.iterdir()) == before


def test_a_log_of_another_schema_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("runtime.log.writer.SCHEMA_VERSION", 99)
    record(tmp_path / "a.rrd", CYCLES[:3])
    for verb in ("info", "verify"):
        code, _, complaint = trundle(capsys, "log", verb, tmp_path / "a.rrd")
        assert code == 2
        assert f"has schema 99; this version of trundle reads {SCHEMA_VERSION}" in complaint


@contextmanager
def as_somebody() -> Iterator[None]:
    """Not be root for a while, who may read everything."""
    ids = os.getresuid()
    if ids[0] == 0:
        os.setresuid(NOBODY, NOBODY, 0)
    try:
        yield
    finally:
        os.setresuid(*ids)


def test_a_log_without_permission_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with TemporaryDirectory() as folder:
        log = Path(folder) / "a.rrd"
        record(log, CYCLES[:3])
        Path(folder).chmod(0o755)  # pytest's own folders are for one user only
        log.chmod(0)
        with as_somebody():
            code, _, complaint = trundle(capsys, "log", "verify", log)
    assert code == 2
    assert f"'{log}' is not readable" in complaint
    assert len(complaint.splitlines()) == 1


def test_each_latched_stop_has_a_recording_of_its_own(tmp_path: Path) -> None:
    report = record(tmp_path / "a.rrd", LATCHED)
    assert report.incidents == (tmp_path / "a.incident-20.rrd", tmp_path / "a.incident-50.rrd")
    assert all(verify(path).findings == () for path in report.incidents)
    assert files_of(tmp_path / "a.rrd") == (tmp_path / "a.rrd",)
    assert record(tmp_path / "b.rrd", LATCHED, incidents=False).incidents == ()
    assert LogSettings().incidents


def test_stops_are_the_beginnings_of_faults_that_stop_but_not_of_starting() -> None:
    stops = Stops()
    starting = (FaultReport(Fault.STARTING, "camera"),)
    slowed = (FaultReport(Fault.WRONG_RATE, "camera"),)
    told = [(starting, Response.STAND_DOWN), ((), Response.RUN), (slowed, Response.DECELERATE), (STOP, Response.LATCH)]
    for cycle, (faults, response) in zip(CYCLES, told, strict=False):
        stops.put(replace(cycle, verdict=replace(cycle.verdict, faults=faults, response=response)))
    assert stops.latched_ticks == [3]
    begun_ns = CYCLES[3].sensed.tick.start_ns
    assert stops.any_near(begun_ns, begun_ns)
    assert not stops.any_near(begun_ns - 20 * 10**9, begun_ns - 6 * 10**9)
