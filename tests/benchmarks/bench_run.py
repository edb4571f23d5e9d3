"""Whole runs of `dynamic_hallway` through the command line, on one core: pace, stages, memory, log and start-up."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tests.benchmarks.figure import Figure

TRUNDLE = Path(sys.executable).with_name("trundle")


def figures() -> list[Figure]:
    """Run with each wheel model, and once for a single tick; what was compiled before is in numba's cache."""
    with one_core():
        report_of("--duration", "0.05")  # compiles, where nothing has yet
        begun = time.perf_counter()
        report_of("--duration", "0.05")
        first_tick_s = time.perf_counter() - begun  # of the whole command, the report and the log's end included
        (ideal, resident_mb), (rollers, _) = report_of(), report_of("--set", "robot.base.wheels=rollers")
    stages = [Figure(f"stage_{name}", times["p50"], times["p99"]) for name, times in ideal["stage_ms"].items()]
    return [
        Figure("first_tick", first_tick_s, unit="s"),
        Figure("real_time_factor_ideal", ideal["realtime_factor"], unit="x"),
        Figure("real_time_factor_rollers", rollers["realtime_factor"], unit="x"),
        Figure("resident_memory", resident_mb, unit="MB"),
        Figure("log_rate", ideal["recording"]["bytes_per_s"] * 1e-6, unit="MB/s"),
        *stages,
    ]


@contextmanager
def one_core() -> Iterator[None]:
    """Keep to the first core that this process may use; so do the processes that it starts."""
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def report_of(*options: str) -> tuple[dict[str, Any], float]:
    """Run the scenario with its recording; return the run report, as its JSON file has it, and the most memory held [MB]."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "report.json"
        command = [TRUNDLE, "run", "dynamic_hallway", "--log", f"{folder}/run.rrd", "--json", path, *options]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)  # a run cut short exits with 1
        process.returncode = os.waitstatus_to_exitcode(status)
        report: dict[str, Any] = json.loads(path.read_text())
        return report, usage.ru_maxrss * 1024e-6
