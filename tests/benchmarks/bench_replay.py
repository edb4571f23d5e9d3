"""How much faster than it was recorded a log is read, and replayed with its estimator and planner."""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from drivers.interface.samples import Intrinsics
from runtime import configuration, run
from runtime.cycle import Cycle
from runtime.keyframes import KeyFrames
from runtime.log.exact import rvl
from runtime.log.exact.stream import rows
from runtime.log.settings import LogSettings
from runtime.log.writer import Writer
from runtime.replay.replay import ReplayOptions, replay
from tests.benchmarks.figure import Figure
from tests.runtime.log_cycles import header, make_cycles

D455_DECIMATED = Intrinsics(283, 160, 142.0, 142.0, 141.0, 79.5)
CYCLES, REPEATED, PERIOD_NS = 300, 5, 20_000_000  # 50 Hz; every fourth tick has no frame
DRIVE_S = 20.0


def figures() -> list[Figure]:
    """Read a log with noisy depth at 38 Hz on a 50 Hz loop, and replay a drive through the hallway at 20 Hz."""
    with TemporaryDirectory() as folder:
        return [
            Figure("replay_reading", _reading(Path(folder) / "a.rrd"), unit="x"),
            Figure("replay_with_estimator", _replaying(Path(folder) / "b.rrd"), unit="x"),
            Figure("key_frame", _key_frame_ms(), unit="ms"),
        ]


def _reading(path: Path) -> float:
    rvl.warm_up()
    writer = Writer(path, LogSettings(), header(), None)
    for index, cycle in enumerate(make_cycles(CYCLES, intrinsics=D455_DECIMATED, period_ns=PERIOD_NS)):
        writer.put(cycle, drawn=True, lost_before=0)
        if index % 25 == 24:
            writer.send()
    writer.close(10.0, last=True)
    start_s = time.perf_counter()
    for _ in range(REPEATED):
        for row in rows(path):
            assert row.is_sound
            assert row.sensed
    return REPEATED * CYCLES * PERIOD_NS * 1e-9 / (time.perf_counter() - start_s)


def _replaying(path: Path) -> float:
    loaded = configuration.load("dynamic_hallway", (f"mission.time_limit_s={DRIVE_S}", "mission.goals=[{x_m: 60.0, y_m: 0.0}]"))
    run.run(loaded, run.RunOptions(log=path))
    report = replay(path, ReplayOptions())
    assert report.identical
    return report.recorded_s / report.took_s


def _key_frame_ms() -> float:
    """Return what the loop's thread spends on a key frame."""
    frames: list[KeyFrames] = []
    taken: list[float] = []
    options = run.RunOptions(
        ready=lambda assembly: frames.append(KeyFrames(assembly.parts, 0.0)),
        progress=lambda cycle: taken.append(_timed(frames[0], cycle)),
    )
    run.run(configuration.load("dynamic_hallway", ("mission.time_limit_s=2",)), options)
    return 1e3 * sorted(taken)[len(taken) // 2]


def _timed(frames: KeyFrames, cycle: Cycle) -> float:
    start_s = time.perf_counter()
    frames.after(cycle)
    return time.perf_counter() - start_s
