"""Whatever happens to the runtime, or to its process at the wire, the emulated base comes to rest.  Times: see the benchmark."""

from collections.abc import Iterator

import pytest

from tests.faults.dead_man import attempt
from tests.faults.emulated import EmulatedRobot, Watcher, emulated

TRIES = 2


@pytest.fixture(scope="module")
def scene() -> Iterator[tuple[EmulatedRobot, Watcher]]:
    with emulated() as robot, robot.watched() as watcher:
        yield robot, watcher


@pytest.mark.parametrize("blow", ["kill", "stop", "kill_io"])
def test_the_base_is_told_zero_or_disarms_and_comes_to_rest(scene, blow):
    robot, watcher = scene
    for number in range(TRIES):
        tried = attempt(robot, watcher, blow, vx_m_s=0.4 if number % 2 else -0.4)
        assert tried.safe_s > 0.0
        assert tried.still_s > 0.0
