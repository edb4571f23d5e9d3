"""What recording costs: the processor, all threads together; the thread of the loop; the disk.

The depth is noisy: white noise of 3 mm at a metre, growing with the square of the distance, without holes, which is more than a
D455 shows and the worst there is for lossless coding (left differences of 7 bits a pixel).
"""

import gc
import sys
import time
from collections import deque
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from drivers.interface.samples import Intrinsics
from runtime.cycle import Cycle
from runtime.log.exact import rvl
from runtime.log.recorder import Recorder
from runtime.log.settings import LogSettings
from runtime.log.writer import Writer
from tests.benchmarks.figure import Figure, of_distribution
from tests.runtime.log_cycles import INTRINSICS, depth_frame, header, make_cycles

D455_DECIMATED = Intrinsics(283, 160, 142.0, 142.0, 141.0, 79.5)
TICKS = 400


def figures() -> list[Figure]:
    """Record a corridor with noisy depth, in batches as large as lockstep has them, and as the flush interval allows."""
    small = make_cycles(TICKS, intrinsics=INTRINSICS, period_ns=50_000_000)
    large = make_cycles(TICKS, intrinsics=D455_DECIMATED, period_ns=20_000_000)
    settings = LogSettings()
    return [
        *_paced(),
        Figure("recorder_cpu_160x90_lockstep", _cpu_ms(small, settings.batch_ticks), unit="ms/tick"),
        Figure("recorder_cpu_160x90_20hz", _cpu_ms(small, 3), unit="ms/tick"),
        Figure("recorder_cpu_283x160_50hz", _cpu_ms(large, 9), unit="ms/tick"),
    ]


def _cpu_ms(cycles: list[Cycle], batch: int) -> float:
    rvl.warm_up()
    with TemporaryDirectory() as folder:
        writer = Writer(Path(folder) / "log.rrd", LogSettings(), header(), None)
        before_ns = time.process_time_ns()
        for start in range(0, len(cycles), batch):
            for cycle in cycles[start : start + batch]:
                writer.put(cycle, drawn=True, lost_before=0)
            writer.send()
            writer.flush(10.0)
        elapsed_ns = time.process_time_ns() - before_ns
        writer.close(10.0)
    return elapsed_ns * 1e-6 / len(cycles)


PERIOD_NS = 20_000_000
PACED_TICKS = 1500
SWITCH_INTERVAL_S = 5e-4  # as the loop's real-time set-up has it


def _paced() -> list[Figure]:
    """Hand over ticks at 50 Hz, depth in three of five, as a loop that has nothing else to do; return cost, work and size."""
    rvl.warm_up()
    cycles = [_at_30_hz(cycle) for cycle in make_cycles(100, intrinsics=D455_DECIMATED, period_ns=PERIOD_NS)]
    ticks = [_moved(cycles[index % 100], index) for index in range(PACED_TICKS)]
    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    gc.collect()
    gc.freeze()
    bare_ns, _ = _hand_over(_Deque(), ticks[:500])
    with TemporaryDirectory() as folder:
        recorder = Recorder(Path(folder) / "log.rrd", LogSettings(), header, lockstep=False)
        recorder.open()
        spent_ns, cpu_ns = _hand_over(recorder, ticks)
        report = recorder.close()
    sys.setswitchinterval(interval_s)
    gc.unfreeze()
    assert report.written_ticks == PACED_TICKS, report
    minutes = PACED_TICKS * PERIOD_NS / 60e9
    return [
        of_distribution(
            "record_at_50hz", [ns * 1e-6 for ns in spent_ns], "ms", "append to a bare deque", [ns * 1e-6 for ns in bare_ns]
        ),
        Figure("recorder_cpu_at_50hz", cpu_ns * 1e-6 / PACED_TICKS, unit="ms/tick"),
        Figure("log_rate_at_50hz", report.bytes_written * 1e-6 / minutes, unit="MB/min"),
        Figure("longest_sync", report.longest_sync_s * 1e3),
    ]


class _Deque:
    """The least that handing over can cost on this machine, after a sleep as long."""

    def __init__(self) -> None:
        self._queue: deque[Cycle] = deque()

    def record(self, cycle: Cycle) -> None:
        self._queue.append(cycle)

    def fault(self) -> str:
        return ""


def _hand_over(recorder: Recorder | _Deque, ticks: list[Cycle]) -> tuple[list[int], int]:
    """Return what each call took [ns], and the work of all threads but the calls' own [ns]."""
    spent_ns: list[int] = []
    begun_ns, cpu_ns, own_ns = time.monotonic_ns(), time.process_time_ns(), time.thread_time_ns()
    for index, cycle in enumerate(ticks):
        time.sleep(max(0, begun_ns + index * PERIOD_NS - time.monotonic_ns()) * 1e-9)
        before_ns = time.perf_counter_ns()
        recorder.record(cycle)
        recorder.fault()
        spent_ns.append(time.perf_counter_ns() - before_ns)
    own_ns = time.thread_time_ns() - own_ns
    return spent_ns, time.process_time_ns() - cpu_ns - own_ns


def _at_30_hz(cycle: Cycle) -> Cycle:
    """Return the cycle with a frame in three of five ticks."""
    index = cycle.sensed.tick.index
    frame = depth_frame(index, cycle.sensed.tick.start_ns, D455_DECIMATED) if index % 5 in {0, 2, 4} else None
    return replace(cycle, sensed=replace(cycle.sensed, depth=frame))


def _moved(cycle: Cycle, index: int) -> Cycle:
    tick = replace(cycle.sensed.tick, index=index, start_ns=10**12 + index * PERIOD_NS)
    return replace(cycle, sensed=replace(cycle.sensed, tick=tick))
