"""Logs of several files: each opens by itself, all are one, and the disk budget spares what is around a stop."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.interface.errors import ConfigurationError
from runtime.cycle import Cycle
from runtime.faults import Fault, FaultReport, Response
from runtime.log.files.paths import files_of, numbered
from runtime.log.reading.opening import reader_of
from runtime.log.reading.read import read, read_file
from runtime.log.reading.repair import repair
from runtime.log.reading.verification import verify
from runtime.log.reading.verify import sensed_at
from runtime.log.settings import LogSettings
from runtime.outputs import log_path
from tests.runtime.log_cycles import bits, make_cycles
from tests.runtime.test_log_recorder import record

CYCLES = make_cycles(80)
CALM = [replace(c, verdict=replace(c.verdict, faults=(), response=Response.RUN)) for c in CYCLES]
SMALL = {"segment_mb": 0.4, "batch_ticks": 5}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "a.rrd"
    report = record(path, CYCLES, **SMALL)
    assert report.files == files_of(path)
    assert [file.name for file in report.files] == [f"a.{index:03d}.rrd" for index in range(len(report.files))]
    assert len(report.files) >= 4
    assert report.bytes_written == sum(file.stat().st_size for file in report.files)
    return path


def test_all_files_are_one_log_whichever_is_named(log: Path) -> None:
    for name in (log, log.with_suffix(""), *files_of(log)):
        assert read(name, "/replay/check").ticks == list(range(80))
    found = read(log)
    for cycle in CYCLES:
        assert bits(sensed_at(found, cycle.sensed.tick.index)) == bits(cycle.sensed)
    assert verify(log).findings == ()


def test_the_same_ticks_are_recorded_as_in_one_file(log: Path, tmp_path: Path) -> None:
    record(tmp_path / "b.rrd", CYCLES)
    assert [*files_of(tmp_path / "b")] == [tmp_path / "b.rrd"]
    one, several = read(tmp_path / "b.rrd", "/replay/**"), read(log, "/replay/**")
    for entity in one.entities:
        exact = [name for name in one.entities[entity] if not name.startswith("EncodedDepthImage:m")]
        for name in (name for name in exact if ":" not in name or name.endswith("blob")):
            assert bits(tuple(map(tuple, one.history(entity, name).values()))) == bits(
                tuple(map(tuple, several.history(entity, name).values()))
            )


def test_every_file_opens_by_itself(log: Path) -> None:
    whole = set(read_file(files_of(log)[0], "/**").entities)
    for file in files_of(log):
        found = read_file(file, "/**")
        assert found.at("/run", -1)["planner"] == ["dwa"]
        assert {"/view/map/static/boxes", "/view/map/odom/grid", "/view/map/odom/base/camera", "/view/response"} <= set(
            found.entities
        )
        assert len(reader_of(file).blueprints()) == 1
        assert reader_of(file).recordings()[0].recording_id == reader_of(files_of(log)[0]).recordings()[0].recording_id
    assert "/replay/check" in whole


def test_the_oldest_files_go_but_for_those_around_a_stop(tmp_path: Path) -> None:
    stop = FaultReport(Fault.SILENT_DEVICE, "camera", "")
    cycles = longer(CALM)
    index = 3
    cycles[index] = replace(cycles[index], verdict=replace(cycles[index].verdict, faults=(stop,), response=Response.STAND_DOWN))
    report = record(tmp_path / "a.rrd", cycles, disk_budget_mb=0.9, **SMALL)
    assert report.deleted_files > 0
    kept = [file.name for file in report.files]
    assert kept[0] == "a.000.rrd"
    assert kept[1:] != [f"a.{i:03d}.rrd" for i in range(1, len(kept))]
    assert [*files_of(tmp_path / "a.rrd")] == [*report.files]
    found = verify(tmp_path / "a.rrd")
    assert not any("files" in sentence for sentence in found.findings)


def test_without_a_stop_the_budget_is_kept(tmp_path: Path) -> None:
    starting = FaultReport(Fault.STARTING, "camera", "")
    cycles = longer(CALM)
    cycles[0] = replace(cycles[0], verdict=replace(cycles[0].verdict, faults=(starting,), response=Response.STAND_DOWN))
    report = record(tmp_path / "a.rrd", cycles, disk_budget_mb=1.0, **SMALL)
    assert report.deleted_files > 0
    assert "a.000.rrd" not in [file.name for file in report.files]
    assert verify(tmp_path / "a.rrd").findings == ()


def longer(cycles: list[Cycle]) -> list[Cycle]:
    """Three seconds apart, so that a stop is close to few of them."""
    spread = []
    for index, cycle in enumerate(cycles):
        tick = replace(cycle.sensed.tick, start_ns=10**12 + index * 3_000_000_000)
        spread.append(replace(cycle, sensed=replace(cycle.sensed, tick=tick)))
    return spread


def test_a_missing_file_is_noticed(tmp_path: Path) -> None:
    record(tmp_path / "a.rrd", CYCLES, **SMALL)
    files = files_of(tmp_path / "a.rrd")
    files[-1].rename(tmp_path / "last")
    assert verify(files[0]).findings == (f"the files after {files[-2].name} are missing",)
    (tmp_path / "last").rename(files[-1])
    files[1].unlink()
    assert verify(files[0]).findings[0] == "of its files, 1 are missing"
    assert any("ticks before" in sentence for sentence in verify(files[0]).findings)


def test_a_last_file_that_a_killed_writer_had_just_begun_does_not_keep_the_rest_from_being_saved(
    log: Path, tmp_path: Path
) -> None:
    files = [shutil.copy(file, tmp_path) for file in files_of(log)]
    numbered(tmp_path / "a.rrd", len(files)).touch()
    saved = repair(tmp_path / "a.rrd")
    assert saved == tmp_path / "a.repaired.rrd"
    assert read(saved, "/replay/check").ticks == list(range(80))
    assert verify(saved).damaged == ()


def test_a_budget_holds_at_least_two_files() -> None:
    with pytest.raises(ValueError, match=r"disk_budget_mb must hold two files of segment_mb, 2000"):
        LogSettings(disk_budget_mb=1500.0)


def test_a_log_of_several_files_is_not_overwritten_unless_forced(log: Path, tmp_path: Path) -> None:
    record(tmp_path / "a.rrd", CYCLES[:60], **SMALL)
    (tmp_path / "a.0.rrd").touch()
    with pytest.raises(ConfigurationError, match=r"a\.000\.rrd exists already; --force overwrites it"):
        log_path(tmp_path / "a.rrd", "", force=False)
    with pytest.raises(ConfigurationError, match="ends like one of several files of a log"):
        log_path(tmp_path / "a.001.rrd", "", force=True)
    assert log_path(tmp_path / "a.rrd", "", force=True) == tmp_path / "a.rrd"
    assert [path.name for path in tmp_path.iterdir()] == ["a.0.rrd"]
