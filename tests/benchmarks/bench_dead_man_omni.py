"""How soon an emulated omni base at full speed is told zero, or disarms, and stands, after its driver was killed or stopped."""

from tests.benchmarks.dead_man import dead_man_figures
from tests.benchmarks.figure import Figure
from tests.faults.commander import LIFETIME_NS
from tests.faults.dead_man import FULL_M_S, attempt
from tests.faults.emulated import emulated

COMMAND_S = LIFETIME_NS * 1e-9
WATCHDOG_S, HEARTBEAT_S = 0.4, 0.1  # an axis that has disarmed says so in its next heartbeat
CONFIGURED_S = {"kill": (COMMAND_S, "ask"), "stop": (COMMAND_S, "ask"), "kill_io": (WATCHDOG_S + HEARTBEAT_S, "coast")}


def figures() -> list[Figure]:
    """Strike, half of the tries in each direction."""
    with emulated() as robot, robot.watched() as watcher:
        return dead_man_figures(
            "omni",
            lambda blow, number: attempt(robot, watcher, blow, FULL_M_S if number % 2 else -FULL_M_S),
            CONFIGURED_S,
        )
