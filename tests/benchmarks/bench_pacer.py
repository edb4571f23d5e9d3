"""How late the pacer wakes at 200 Hz, beside the same loop in C, alternated in one run."""

import subprocess
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

from drivers.interface.clock import RealClock
from runtime.pacer import Pacer
from tests.benchmarks.figure import Figure, of_distribution

PERIOD_NS = 5_000_000
TICKS = 100  # a round; half a second, so that both meet the same disturbances
ROUNDS = 30
SOURCE = Path(__file__).with_name("pacer_reference.c")


def figures() -> list[Figure]:
    """Measure lateness [us]: ours, C, ours, C and so on."""
    ours: list[float] = []
    theirs: list[float] = []
    with TemporaryDirectory() as folder:
        program = Path(folder) / "pacer_reference"
        subprocess.run(["cc", "-O2", "-o", program, SOURCE], check=True)
        for _ in range(ROUNDS):
            ours += lateness_of_pacer_us()
            theirs += lateness_in_c_us(program)
    return [of_distribution("pacer_lateness_200hz", ours, "us", "C, clock_nanosleep", theirs)]


def lateness_of_pacer_us() -> list[float]:
    """Run the loop's own pacer over one round; the first tick, which does not sleep, is left out."""
    ticks = islice(Pacer(RealClock(), PERIOD_NS, lockstep=False), 1, TICKS + 1)
    return [tick.lateness_ns * 1e-3 for tick in ticks]


def lateness_in_c_us(program: Path) -> list[float]:
    """Run the C program over one round."""
    done = subprocess.run([program, str(PERIOD_NS), str(TICKS)], check=True, capture_output=True, text=True)
    return [int(line) * 1e-3 for line in done.stdout.split()]
