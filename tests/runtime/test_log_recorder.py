import os
import signal
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from runtime.cycle import Cycle
from runtime.log.reading.read import read, same_content
from runtime.log.reading.repair import repair
from runtime.log.reading.verify import damaged_ticks, sensed_at
from runtime.log.recorder import Recorder, RecorderReport
from runtime.log.settings import LogSettings
from tests.runtime.log_cycles import bits, header, make_cycles

CYCLES = make_cycles(60)


def record(path: Path, cycles: list[Cycle], **settings: object) -> RecorderReport:
    recorder = Recorder(path, LogSettings(**settings), header, lockstep=True)  # type: ignore[arg-type]
    recorder.open()
    for cycle in cycles:
        recorder.record(cycle)
    return recorder.close()


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "a.rrd"
    assert record(path, CYCLES) == RecorderReport(60, 0, 0, path.stat().st_size, 60, (path,))
    return path


def test_what_the_loop_consumed_comes_back_bit_for_bit(log: Path) -> None:
    found = read(log)
    assert found.ticks == list(range(60))
    assert damaged_ticks(found) == []
    for cycle in CYCLES:
        assert bits(sensed_at(found, cycle.sensed.tick.index)) == bits(cycle.sensed)


def test_what_the_loop_decided_is_there_under_its_name(log: Path) -> None:
    found = read(log, "/replay/**")
    for cycle in CYCLES:
        verdict = found.at("/replay/verdict", cycle.sensed.tick.index)
        assert cycle.verdict.command.base is not None
        assert verdict["command.base.wz"].tobytes() == bits(cycle.verdict.command.base.wz)
        assert verdict["response"] == [cycle.verdict.response.name]
        assert [*verdict.get("faults.fault", [])] == [report.fault.name for report in cycle.verdict.faults]
    assert found.history("/replay/belief", "odom_from_base.x")[7][0] == CYCLES[7].belief.odom_from_base.x


def test_the_header_is_there(log: Path) -> None:
    run = read(log, "/run").at("/run", -1)
    assert run["configuration"] == ["robot: {}\n"]
    assert (run["seed"][0], run["scenario"], run["planner"], bool(run["replayable"][0])) == (3, ["hallway"], ["dwa"], True)


def test_two_recordings_of_the_same_cycles_have_the_same_content(log: Path, tmp_path: Path) -> None:
    later = [replace(cycle, stage_ns=tuple(ns + 5 for ns in cycle.stage_ns)) for cycle in make_cycles(60)]
    record(tmp_path / "b.rrd", later, batch_ticks=7, queue_ticks=11)
    assert same_content(log, tmp_path / "b.rrd") == ""


@pytest.mark.parametrize("value", [0.3000001, -0.0, float("nan")])
def test_a_changed_command_is_named_with_its_tick_and_both_values(log: Path, tmp_path: Path, value: float) -> None:
    changed = list(CYCLES)
    plan = replace(CYCLES[41].plan, base=BodyTwist(0.6, value, 0.0))
    changed[41] = replace(CYCLES[41], plan=plan)
    record(tmp_path / "b.rrd", changed)
    difference = same_content(log, tmp_path / "b.rrd")
    assert difference.startswith("/replay/plan base.v")
    assert "at tick 41" in difference


def test_a_missing_tick_is_a_difference(log: Path, tmp_path: Path) -> None:
    record(tmp_path / "b.rrd", CYCLES[:-1])
    assert "at tick 59" in same_content(log, tmp_path / "b.rrd")


def test_a_full_queue_costs_drawings_first_and_then_ticks_and_all_is_counted(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.rrd", LogSettings(queue_ticks=10, flush_interval_s=10), header, lockstep=False)
    recorder.open()
    recorder._due = 11  # nobody wakes the writer
    for cycle in CYCLES[:14]:
        recorder.record(cycle)
    recorder._work.give()
    recorder._room.take(10)
    recorder.record(CYCLES[14])
    report = recorder.close()
    assert (report.written_ticks, report.dropped_views, report.dropped_ticks, report.queue_high_water) == (11, 5, 4, 10)
    found = read(tmp_path / "a.rrd")
    assert found.ticks == [*range(10), 14]
    assert damaged_ticks(found) == []
    lost = found.history("/replay/check", "lost_before")
    assert {tick: int(cell[0]) for tick, cell in lost.items() if cell[0]} == {14: 4}
    assert [*found.history("/view/map/trail", "Points3D:positions")] == [0, 1, 2, 3, 4, 14]


def test_in_lockstep_the_loop_waits_and_nothing_is_dropped(tmp_path: Path) -> None:
    report = record(tmp_path / "a.rrd", CYCLES, queue_ticks=2)
    assert (report.written_ticks, report.dropped_ticks, report.dropped_views, report.queue_high_water) == (60, 0, 0, 2)


def test_without_depth_a_log_says_that_it_cannot_be_replayed(tmp_path: Path) -> None:
    record(tmp_path / "a.rrd", CYCLES[:3], depth=False)
    found = read(tmp_path / "a.rrd")
    assert not found.at("/run", -1)["replayable"][0]
    with pytest.raises(ConfigurationError, match=r"tick 0 of .* cannot be replayed: the log holds too few values"):
        sensed_at(found, 0)


@pytest.mark.parametrize("path", ["missing/folder/a.rrd", "."])
def test_a_log_that_cannot_be_created_is_a_fault_and_the_run_goes_on(tmp_path: Path, path: str) -> None:
    recorder = Recorder(tmp_path / path, LogSettings(), header, lockstep=True)
    recorder.open()
    assert recorder.fault().startswith(f"the log {tmp_path / path} cannot be created: ")
    recorder.record(CYCLES[0])
    assert recorder.close() == RecorderReport(dropped_ticks=1, fault=recorder.fault())


def test_it_can_be_closed_in_every_state(tmp_path: Path) -> None:
    never = Recorder(tmp_path / "a.rrd", LogSettings(), header, lockstep=False)
    assert never.close() == never.close() == RecorderReport()
    assert not (tmp_path / "a.rrd").exists()
    none = Recorder(None, LogSettings(), header, lockstep=False)
    none.open()
    none.record(CYCLES[0])
    assert none.close() == RecorderReport()
    twice = Recorder(tmp_path / "b.rrd", LogSettings(), header, lockstep=False)
    twice.open()
    twice.open()
    twice.record(CYCLES[0])
    assert twice.close() == twice.close()
    twice.record(CYCLES[1])
    assert read(tmp_path / "b.rrd").ticks == [0]


def test_a_value_that_cannot_be_recorded_is_a_fault_and_what_came_before_is_kept(tmp_path: Path) -> None:
    broken = replace(CYCLES[30], plan=replace(CYCLES[30].plan, base=BodyTwist("fast", 0.0, 0.0)))  # type: ignore[arg-type]
    report = record(tmp_path / "a.rrd", [*CYCLES[:30], broken, *CYCLES[31:]], batch_ticks=10)
    assert "cannot be written" in report.fault
    assert report.written_ticks == 30
    assert report.dropped_ticks > 0
    assert read(tmp_path / "a.rrd").ticks == list(range(30))


def test_a_stalled_disk_costs_ticks_but_no_memory_and_no_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("runtime.log.recorder._CLOSE_TIMEOUT_S", 0.2)
    path = tmp_path / "a.rrd"
    os.mkfifo(path)
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # someone holds the other end and never reads
    recorder = Recorder(path, LogSettings(flush_interval_s=0.05, queue_ticks=10), header, lockstep=False)
    recorder.open()
    for cycle in CYCLES * 20:
        recorder.record(cycle)
        recorder._room.take(0.001)  # as a loop that sleeps
    report = recorder.close()
    assert report.fault == f"the log {path} is incomplete: its disk is stalled"
    assert report.queue_high_water == 10
    assert report.dropped_ticks > 0
    os.close(reader)


def test_the_live_view_needs_no_file_and_a_free_port(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        recorder = Recorder(None, LogSettings(live_port=port), header, lockstep=True, live=True)
        with pytest.raises(ConfigurationError, match=f"log.live_port {port} is taken"):
            recorder.open()
        assert recorder.close() == RecorderReport()
    free = Recorder(None, LogSettings(live_port=port), header, lockstep=True, live=True)
    free.open()
    free.record(CYCLES[0])
    assert free.close() == RecorderReport(written_ticks=1, queue_high_water=1)


RECORD_UNTIL_KILLED = """
import sys
from itertools import count
from pathlib import Path
from runtime.log.recorder import Recorder
from runtime.log.reading.repair import repair
from runtime.log.settings import LogSettings
from tests.runtime.log_cycles import header, make_cycles
cycles = make_cycles(10)
recorder = Recorder(Path(sys.argv[1]), LogSettings(batch_ticks=10), header, lockstep=True)
recorder.open()
from dataclasses import replace
for index in count():
    cycle = cycles[index % 10]
    tick = replace(cycle.sensed.tick, index=index, start_ns=index * 50_000_000)
    recorder.record(replace(cycle, sensed=replace(cycle.sensed, tick=tick)))
    if recorder.fault():
        print("fault:", recorder.fault(), flush=True)
        print(recorder.close().written_ticks, flush=True)
        break
    print(recorder._written_ticks, flush=True)
"""


def start(path: Path, code: str = RECORD_UNTIL_KILLED) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", code, str(path)],
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[2],
        env=os.environ | {"PYTHONPATH": "."},
    )


def test_what_was_flushed_before_a_kill_is_readable_and_whole(tmp_path: Path) -> None:
    with start(tmp_path / "a.rrd") as child:
        assert child.stdout is not None
        written = 0
        while written < 60:
            written = int(child.stdout.readline())
        child.send_signal(signal.SIGKILL)
        written = max([written, *(int(line) for line in child.stdout.read().split())])
    found = read(readable(tmp_path / "a.rrd"))
    assert found.ticks[: written - 10] == list(range(written - 10))  # the newest batch may still be in the pipe
    assert damaged_ticks(found) == []


def readable(path: Path) -> Path:
    """The log itself, or what is saved of it if it was cut in the middle of a message."""
    try:
        read(path)
    except ConfigurationError:
        repair(path, path.with_suffix(".repaired.rrd"))
        return path.with_suffix(".repaired.rrd")
    return path


@pytest.mark.parametrize("share", [0.5, 0.7, 0.9, 0.999])
def test_a_log_that_was_cut_anywhere_gives_back_its_whole_batches(tmp_path: Path, share: float) -> None:
    record(tmp_path / "a.rrd", CYCLES, batch_ticks=5)
    whole = (tmp_path / "a.rrd").read_bytes()
    (tmp_path / "b.rrd").write_bytes(whole[: int(share * len(whole))])
    found = read(readable(tmp_path / "b.rrd"))
    damaged = damaged_ticks(found)
    assert found.ticks == list(range(len(found.ticks)))
    assert len(found.ticks) >= 60 * share - 10
    assert all(tick >= len(found.ticks) - 5 for tick in damaged)  # only the batch that was cut


def test_a_disk_that_fills_up_is_a_fault_and_the_process_goes_on_and_ends(tmp_path: Path) -> None:
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (800_000, 800_000))\n"
    child = start(tmp_path / "a.rrd", limit + RECORD_UNTIL_KILLED)
    output, _ = child.communicate(timeout=60)
    fault, written = output.splitlines()[-2:]
    assert fault == f"fault: the log {tmp_path / 'a.rrd'} cannot be written: File too large"
    assert int(written) > 0
    assert child.returncode == 0
    assert (tmp_path / "a.rrd").stat().st_size == 800_000
