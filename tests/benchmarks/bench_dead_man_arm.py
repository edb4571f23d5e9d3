"""How soon an emulated arm that swings begins to brake, and stands, after its driver was killed or stopped."""

from tests.benchmarks.dead_man import dead_man_figures
from tests.benchmarks.figure import Figure
from tests.faults.arm_commander import LIFETIME_NS
from tests.faults.arm_dead_man import arm_scene

COMMAND_S = LIFETIME_NS * 1e-9
LOST_S = 0.02  # commands in a row, until the controller ends a motion by itself
CONFIGURED_S = {"kill": (COMMAND_S, "ask"), "stop": (COMMAND_S, "ask"), "kill_io": (LOST_S, "ask")}


def figures() -> list[Figure]:
    """Strike at 1 rad/s and more of its first joint."""
    with arm_scene() as scene:
        return dead_man_figures("arm", lambda blow, _: scene.attempt(blow), CONFIGURED_S)
