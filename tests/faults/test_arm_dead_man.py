"""Whatever happens to the runtime, or to its process at the wire, the emulated arm comes to rest.  Times: see the benchmark."""

import pytest

from tests.faults.arm_dead_man import arm_scene


@pytest.fixture(scope="module")
def scene():
    with arm_scene() as one:
        yield one


@pytest.mark.parametrize("blow", ["kill", "stop", "kill_io"])
def test_the_arm_decelerates_and_stands(scene, blow):
    for _ in range(2):
        tried = scene.attempt(blow)
        assert 0.0 < tried.safe_s < tried.still_s
