"""What the loop itself costs a tick: read, admit, write, hand to the recorder; estimator and planner are not counted."""

from pathlib import Path
from tempfile import TemporaryDirectory

from runtime import configuration, run
from runtime.cycle import STAGES, Cycle
from tests.benchmarks.figure import Figure, of_distribution

SECONDS = 10
SETTINGS = ("loop.rate_hz=50", "loop.realtime=true", f"mission.time_limit_s={SECONDS}")
OVERHEAD = [STAGES.index(stage) for stage in ("sense", "admit", "write", "record")]
RECORD = STAGES.index("record")


def figures() -> list[Figure]:
    """Drive the dynamic hallway, recorded, at 50 Hz of the host's time; the first second is left out."""
    stage_ns: list[tuple[int, ...]] = []

    def take(cycle: Cycle) -> None:
        stage_ns.append(cycle.stage_ns)

    with TemporaryDirectory() as folder:
        options = run.RunOptions(log=Path(folder) / "run.rrd", progress=take)
        run.run(configuration.load("dynamic_hallway", SETTINGS), options)
    steady = stage_ns[50:]
    overhead_ms = [sum(ticks[stage] for stage in OVERHEAD) * 1e-6 for ticks in steady]
    handover_ms = [ticks[RECORD] * 1e-6 for ticks in steady]
    return [of_distribution("tick_overhead", overhead_ms), of_distribution("record_handover", handover_ms)]
