"""Whatever happens to the runtime, or to its process at the wire, the emulated arm comes to rest.  Times: see the benchmark."""

import pytest

from tests.faults.arm_dead_man import SWINGING_RAD_S, arm_scene


@pytest.fixture(scope="module")
def scene():
    with arm_scene() as one:
        yield one


@pytest.mark.parametrize("blow", ["kill", "stop", "kill_io"])
def test_the_arm_decelerates_and_stands(scene, blow):
    for _ in range(2):
        tried = scene.attempt(blow)
        assert tried.speed_rad_s > SWINGING_RAD_S
        assert tried.still_s > 0.02
