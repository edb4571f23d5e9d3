"""How soon an emulated base is told zero, or disarms, and stands, after its driver's process was killed or stopped at speed."""

from tests.benchmarks.figure import Figure, of_distribution
from tests.faults.dead_man import attempt
from tests.faults.emulated import emulated

TRIES = 20


def figures() -> list[Figure]:
    """Strike at 0.25 m/s and more, half of the tries in each direction."""
    measured = []
    with emulated() as robot, robot.watched() as watcher:
        for blow in ("kill", "stop", "kill_io"):
            tries = [attempt(robot, watcher, blow, 0.4 if number % 2 else -0.4) for number in range(TRIES)]
            measured.append(of_distribution(f"dead_man_{blow}_safe", [1e3 * each.safe_s for each in tries]))
            measured.append(of_distribution(f"dead_man_{blow}_still", [1e3 * each.still_s for each in tries]))
    return measured
