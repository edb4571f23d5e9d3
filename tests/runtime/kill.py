"""Kills a process in the middle of recording and looks at what it leaves: as a module, the process that is killed.

`python -m tests.runtime.kill PATH` records cycles at 50 Hz in real time and prints each tick with the time it was handed over.
"""

import itertools
import random
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from drivers.interface.errors import ConfigurationError
from runtime.log.files.paths import files_of
from runtime.log.reading.repair import repair
from runtime.log.reading.verification import Verification, verify
from runtime.log.recorder import Recorder
from runtime.log.settings import LogSettings
from tests.runtime.log_cycles import header, make_cycles

PERIOD_NS = 20_000_000
LATELY_S = 1.0
SETTINGS = LogSettings(segment_mb=1.0)  # so small that some are killed while one file ends and the next begins


def record_until_killed(path: Path) -> None:
    cycles = make_cycles(50, period_ns=PERIOD_NS)
    recorder = Recorder(path, SETTINGS, header, lockstep=False)
    recorder.open()
    begun_ns = time.monotonic_ns()
    for index in itertools.count():
        due_ns = begun_ns + index * PERIOD_NS
        time.sleep(max(0, due_ns - time.monotonic_ns()) * 1e-9)
        cycle = cycles[index % 50]
        tick = replace(cycle.sensed.tick, index=index, start_ns=due_ns)
        recorder.record(replace(cycle, sensed=replace(cycle.sensed, tick=tick)))
        print(index, time.monotonic_ns(), recorder.fault(), flush=True)


def lost_after_kill(folder: Path, seed: int, *, shared: bool = False) -> str:
    """Record, kill after a random time and return what is wrong with the log; empty if all older than the interval is there.

    On a `shared` machine, older than the interval and the time for which threads of the process, over the last second, were
    ready to go on and had no processor because others had it: no recorder can write then.
    """
    path = folder / f"{seed}.rrd"
    command = [sys.executable, "-m", "tests.runtime.kill", str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as child:
        assert child.stdout is not None
        said = [child.stdout.readline()]
        alive_s = random.Random(seed).uniform(0.3, 2.5)
        time.sleep(max(0.0, alive_s - LATELY_S))
        before_ns = _kept_waiting_ns(child.pid)
        time.sleep(min(alive_s, LATELY_S))
        waited_ns = _kept_waiting_ns(child.pid) - before_ns
        killed_ns = time.monotonic_ns()
        child.kill()
        said += child.stdout.readlines()
    handed_over = [tuple(map(int, line.split()[:2])) for line in said if len(line.split()) >= 2]
    kept_ns = killed_ns - round(SETTINGS.flush_interval_s * 1e9) - (waited_ns if shared else 0)
    due = {tick for tick, time_ns in handed_over if time_ns < kept_ns}
    found = _verified(path)
    missing = due - set(range(found.ticks))
    if found.damaged or found.gaps or missing:
        lost = f"damaged {found.damaged}, gaps {found.gaps}, missing {sorted(missing)} of {len(due)}"
        return f"seed {seed}: {lost}, waited for a processor {waited_ns * 1e-9:.3f} s"
    return ""


def _kept_waiting_ns(process: int) -> int:
    """Return for how long all threads of a process have waited for a processor so far.

    Source: the Linux kernel's Documentation/scheduler/sched-stats.rst, /proc/PID/schedstat; 0 where it does not count that.
    """
    waited_ns = 0
    for path in Path(f"/proc/{process}/task").glob("*/schedstat"):
        with suppress(OSError):  # the thread has just ended
            waited_ns += int(path.read_text().split()[1])
    return waited_ns


def _verified(path: Path) -> Verification:
    """Verify the log, or what can be saved of it if it was cut in the middle of a message."""
    try:
        return verify(path)
    except ConfigurationError:
        return verify(repair(path))
    finally:
        for file in files_of(path):
            file.unlink(missing_ok=True)


if __name__ == "__main__":
    record_until_killed(Path(sys.argv[1]))
