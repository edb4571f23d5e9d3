"""A camera's clock on ours: offset, drift, turns of its counter, jumps; delays are never taken for time."""

import numpy as np
import pytest

from drivers.realsense.device_clock import DeviceClock

SECOND_NS = 1_000_000_000
COUNTER_NS = 2**32 * 1000


def errors_ns(clock, host_ns, device_ns, delay_ns):
    """Return how far each capture is taken from where it was."""
    found = [clock.to_host(int(d), int(h + w)) for d, h, w in zip(device_ns, host_ns, delay_ns, strict=True)]
    return np.array(found) - host_ns


@pytest.mark.parametrize("drift", [0.0, 80e-6, -80e-6])
@pytest.mark.parametrize("offset_s", [0.0, 4290.0])  # the counter turns five seconds later
def test_offset_and_drift_are_found_below_the_jitter(drift, offset_s):
    rng = np.random.default_rng(1)
    host_ns = 50 * SECOND_NS + (np.arange(1800) * SECOND_NS) // 30
    device_ns = (np.round(host_ns * (1 + drift) + offset_s * 1e9) % COUNTER_NS) // 1000 * 1000
    delay_ns = 8_000_000 + rng.exponential(3_000_000, len(host_ns))
    clock = DeviceClock(8_000_000, COUNTER_NS)
    wrong_ns = errors_ns(clock, host_ns, device_ns, delay_ns)
    assert np.abs(wrong_ns[150:]).max() < 2_000_000
    assert np.abs(wrong_ns[900:]).max() < 500_000  # of delays that vary by 20 ms
    assert clock.drift == pytest.approx(-drift, abs=15e-6)
    assert clock.jumps == 0


def test_a_stall_is_a_delay_and_a_jump_is_not():
    clock = DeviceClock(0, COUNTER_NS)
    host_ns = np.arange(60) * (SECOND_NS // 30)
    assert np.abs(errors_ns(clock, host_ns, host_ns, np.full(60, 5_000_000)))[1:].max() <= 5_000_000
    assert clock.to_host(2 * SECOND_NS, 2 * SECOND_NS + 800_000_000) == pytest.approx(2 * SECOND_NS + 5_000_000, abs=10)
    assert clock.jumps == 0
    assert clock.to_host(40 * SECOND_NS, 3 * SECOND_NS) == 3 * SECOND_NS
    assert clock.jumps == 1


def test_nothing_is_captured_after_it_arrived():
    clock = DeviceClock()
    rng = np.random.default_rng(0)
    for index in range(200):
        arrived_ns = index * 10_000_000 + int(rng.integers(0, 5_000_000))
        assert clock.to_host(index * 10_000_000, arrived_ns) <= arrived_ns
