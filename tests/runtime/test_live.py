import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import rerun as rr
import rerun.blueprint as rrb

from runtime.log.exact.columns import ArrowColumn, timelines
from runtime.log.files.live import LiveView
from runtime.log.reading.repair import quiet_environment, rerun_program
from runtime.log.recorder import Recorder
from runtime.log.settings import LogSettings
from tests.ports import free_port
from tests.runtime.log_cycles import header, make_cycles

MEGABYTE = np.random.default_rng(1).integers(0, 2**62, 125_000)  # does not compress


@contextmanager
def watcher(port: int, into: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A program that takes what the live view serves, as a viewer does, and needs no graphics."""
    command = [rerun_program(), f"rerun+http://127.0.0.1:{port}/proxy", "--save", str(into)]
    with subprocess.Popen(command, env=quiet_environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as child:
        try:
            yield child
        finally:
            child.kill()


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def size(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


def send(view: LiveView, tick: int, values: np.ndarray) -> None:
    flat = pa.array(values)
    column = ArrowColumn(rr.ComponentDescriptor("noise"), pa.ListArray.from_arrays(pa.array([0, len(values)], pa.int32()), flat))
    view.send_columns("/noise", timelines((tick,), (tick,)), (column,))


def test_a_stalled_viewer_costs_what_it_would_have_seen_and_nobody_waits_for_it(tmp_path: Path) -> None:
    port = free_port()
    view = LiveView(port, rrb.Blueprint())
    with watcher(port, tmp_path / "a.rrd") as child:
        tick = 0
        while size(tmp_path / "a.rrd") < 2_000_000:
            send(view, tick := tick + 1, MEGABYTE)
            time.sleep(0.02)
        child.send_signal(signal.SIGSTOP)
        deadline = time.monotonic() + 30.0
        while view.dropped_sends == 0:  # the server is stalled and the queue is full
            send(view, tick := tick + 1, MEGABYTE)
            assert time.monotonic() < deadline
            time.sleep(0.001)
        child.kill()
    with watcher(port, tmp_path / "b.rrd"):  # one that joins late sees what is still held, and what comes
        wait_for(lambda: size(tmp_path / "b.rrd") > 2_000_000)
    view.close()


def test_the_log_is_whole_although_nobody_can_see_it(tmp_path: Path) -> None:
    port = free_port()
    recorder = Recorder(tmp_path / "a.rrd", LogSettings(live_port=port), header, lockstep=True, live=True)
    recorder.open()
    with watcher(port, tmp_path / "b.rrd") as child:
        cycles = make_cycles(60)
        for cycle in cycles[:30]:
            recorder.record(cycle)
        wait_for(lambda: size(tmp_path / "b.rrd") > 0)
        child.send_signal(signal.SIGSTOP)
        for cycle in cycles[30:]:
            recorder.record(cycle)
        report = recorder.close()
    assert (report.written_ticks, report.dropped_ticks, report.fault) == (60, 0, "")
