"""What recording costs the processor, all threads together, a tick; what it costs the loop is measured in its run."""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from drivers.interface.samples import Intrinsics
from runtime.cycle import Cycle
from runtime.log import rvl
from runtime.log.settings import LogSettings
from runtime.log.writer import Writer
from tests.benchmarks.figure import Figure
from tests.runtime.log_cycles import INTRINSICS, header, make_cycles

D455_DECIMATED = Intrinsics(283, 160, 142.0, 142.0, 141.0, 79.5)
TICKS = 400


def figures() -> list[Figure]:
    """Record a corridor with noisy depth, in batches as large as lockstep has them, and as the flush interval allows."""
    small = make_cycles(TICKS, intrinsics=INTRINSICS, period_ns=50_000_000)
    large = make_cycles(TICKS, intrinsics=D455_DECIMATED, period_ns=20_000_000)
    settings = LogSettings()
    return [
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
