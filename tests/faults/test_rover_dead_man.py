"""Whatever happens to the runtime, or to its process at the wire, the emulated rover comes to rest.  Times: see the benchmark."""

from collections.abc import Iterator

import pytest

from tests.faults.rover_dead_man import Rover, rover


@pytest.fixture(scope="module")
def scene() -> Iterator[Rover]:
    with rover() as running:
        yield running


@pytest.mark.parametrize("blow", ["kill", "stop", "kill_io"])
def test_the_rover_is_told_zero_or_times_out_and_comes_to_rest(scene, blow):
    for vx_m_s in (0.4, -0.4):
        tried = scene.attempt(blow, vx_m_s)
        assert 0.0 < tried.safe_s < tried.still_s
        assert scene.timed_out == (blow == "kill_io")  # else zero came from the process at the wire
