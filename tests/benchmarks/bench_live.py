"""A viewer that is stalled for 30 s, beside the same loop without one: deadlines, lost ticks, memory."""

import os
import signal
import subprocess
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from drivers.interface.samples import Intrinsics
from runtime.log.reading.repair import quiet_environment, rerun_program
from runtime.log.recorder import Recorder
from runtime.log.settings import LogSettings
from tests.benchmarks.figure import Figure, of_distribution
from tests.runtime.log_cycles import header, make_cycles

PERIOD_NS = 20_000_000
PORT = 9877
SETTLE_S, STALL_S = 10.0, 30.0
D455_DECIMATED = Intrinsics(283, 160, 142.0, 142.0, 141.0, 79.5)


class Loop:
    """Hands a tick to the recorder every 20 ms, by the host's clock."""

    def __init__(self, recorder: Recorder) -> None:
        self._recorder, self._index = recorder, 0
        self._cycles = make_cycles(200, intrinsics=D455_DECIMATED, period_ns=PERIOD_NS)

    def drive(self, seconds: float) -> tuple[list[float], int]:
        """Return how long each hand-over took [ms], and the deadlines missed by it (not by a loop that woke late)."""
        took_ms, missed, grid_ns = [], 0, time.monotonic_ns()
        for _ in range(round(seconds * 1e9 / PERIOD_NS)):
            time.sleep(max(0, grid_ns - time.monotonic_ns()) / 1e9)
            cycle = self._cycles[self._index % len(self._cycles)]
            tick = replace(cycle.sensed.tick, index=self._index, start_ns=grid_ns)
            cycle = replace(cycle, sensed=replace(cycle.sensed, tick=tick))
            before_ns = time.perf_counter_ns()
            self._recorder.record(cycle)
            took_ms.append((time.perf_counter_ns() - before_ns) / 1e6)
            missed += took_ms[-1] * 1e6 > PERIOD_NS
            self._index += 1
            grid_ns = max(grid_ns + PERIOD_NS, time.monotonic_ns())
        return took_ms, missed


def figures() -> list[Figure]:
    """Drive without a viewer, then with one that is stopped, then with that one killed."""
    with TemporaryDirectory() as folder:
        recorder = Recorder(Path(folder) / "log.rrd", LogSettings(live_port=PORT), header, lockstep=False, live=True)
        recorder.open()
        loop = Loop(recorder)
        alone_ms, alone_missed = loop.drive(STALL_S)
        command = [rerun_program(), f"rerun+http://127.0.0.1:{PORT}/proxy", "--save", f"{folder}/seen.rrd"]
        viewer = subprocess.Popen(command, env=quiet_environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            loop.drive(SETTLE_S)
            viewer.send_signal(signal.SIGSTOP)
            before_mb, lost_before = _resident_mb(), recorder._dropped_ticks
            stalled_ms, stalled_missed = loop.drive(STALL_S)
            grown_mb, lost = _resident_mb() - before_mb, recorder._dropped_ticks - lost_before
        finally:
            viewer.kill()
        loop.drive(SETTLE_S)
        recorder.close()
    return [
        of_distribution("live_record_viewer_stalled", stalled_ms, "ms", "without a viewer", alone_ms),
        Figure("live_deadlines_missed_stalled", stalled_missed, unit="", peer="without a viewer", peer_value=alone_missed),
        Figure("live_ticks_lost_stalled", lost, unit=""),
        Figure("live_memory_grown_stalled", grown_mb, unit="MB"),
    ]


def _resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
