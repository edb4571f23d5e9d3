"""What an emulated world costs: a second of it, with its controllers on a multicast bus and its truth on loopback."""

from runtime import configuration
from runtime.emulate import build, opened
from tests.benchmarks.figure import Figure, timed
from tests.ports import free_port

SECOND_NS = 1_000_000_000


def figures() -> list[Figure]:
    """Step the emulated XLeRobot as fast as the machine can."""
    changes = ("robot=xlerobot_emulated", f"robot.base.bus.port={free_port()}", f"robot.truth.port={free_port()}")
    emulation = build(configuration.load("square", changes), seed=0)
    with opened(emulation):
        return [timed("emulated_second_omni", lambda: emulation.world.step_to(emulation.world.now_ns + SECOND_NS))]
