"""How soon an emulated rover at full speed has zero, or times out, and stands, after its driver was killed or stopped."""

from tests.benchmarks.dead_man import dead_man_figures
from tests.benchmarks.figure import Figure
from tests.faults.rover_dead_man import FULL_M_S, LIFETIME_NS, rover

COMMAND_S = LIFETIME_NS * 1e-9
TIMEOUT_S = 3.0  # the autopilot's own, for set-points
CONFIGURED_S = {"kill": (COMMAND_S, "ask"), "stop": (COMMAND_S, "ask"), "kill_io": (TIMEOUT_S, "ask")}


def figures() -> list[Figure]:
    """Strike, half of the tries in each direction."""
    with rover() as scene:
        return dead_man_figures(
            "rover", lambda blow, number: scene.attempt(blow, FULL_M_S if number % 2 else -FULL_M_S), CONFIGURED_S
        )
