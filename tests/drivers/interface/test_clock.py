import signal
import threading
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.interface.clock import Clock, PacedClock, RealClock, SimClock

MS = 1_000_000


class World:
    """Remembers what it was stepped to; a step never goes back."""

    def __init__(self, now_ns: int = 0) -> None:
        self.now_ns = now_ns
        self.steps: list[int] = []

    def step_to(self, time_ns: int) -> None:
        self.steps.append(time_ns)
        self.now_ns = max(self.now_ns, time_ns)


@given(st.lists(st.integers(-(10**9), 10**10), max_size=20))
def test_simulated_time_is_the_latest_deadline_and_never_goes_back(deadlines):
    world = World(5)
    clock: Clock = SimClock(world)
    latest = 5
    for deadline in deadlines:
        clock.sleep_until(deadline)
        latest = max(latest, deadline)
        assert clock.now_ns() == world.now_ns == latest
    assert world.steps == sorted(set(world.steps))  # stepped only when time passes


def test_without_a_world_time_jumps():
    clock = SimClock()
    clock.sleep_until(3_000 * MS)
    assert clock.now_ns() == 3_000 * MS


def test_the_real_clock_never_returns_early():
    clock = RealClock()
    for delay_ns in (0, 1, 1_000, 100_000, 3 * MS):
        deadline = clock.now_ns() + delay_ns
        clock.sleep_until(deadline)
        assert clock.now_ns() >= deadline


def test_a_deadline_in_the_past_returns_at_once():
    clock = RealClock()
    for deadline in (-1, 0, clock.now_ns() - 10**9):
        clock.sleep_until(deadline)


def test_a_signal_is_handled_during_the_sleep_and_does_not_shorten_it():
    """The alarm comes 20 ms into a sleep of 60 ms; its handler must run, and the deadline must hold."""
    clock = RealClock()
    handled_ns: list[int] = []
    before = signal.signal(signal.SIGALRM, lambda *_: handled_ns.append(time.monotonic_ns()))
    try:
        deadline = clock.now_ns() + 60 * MS
        signal.setitimer(signal.ITIMER_REAL, 0.02)
        clock.sleep_until(deadline)
        assert clock.now_ns() >= deadline
        assert handled_ns
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def test_an_interrupt_ends_the_sleep():
    """A handler that raises, as Ctrl-C's does, must get through although the deadline is an hour away."""

    class AlarmError(Exception):
        pass

    def interrupt(*_: object) -> None:
        raise AlarmError

    clock = RealClock()
    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.02)
        with pytest.raises(AlarmError):
            clock.sleep_until(clock.now_ns() + 3_600_000 * MS)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def test_other_threads_run_while_it_sleeps():
    clock = RealClock()
    ran = threading.Event()
    threading.Thread(target=ran.set).start()
    clock.sleep_until(clock.now_ns() + 20 * MS)
    assert ran.wait(10.0)


def test_two_threads_may_sleep_on_one_clock():
    """Each has its own deadline; neither may return early because the other one's is sooner."""
    clock = RealClock()
    start = clock.now_ns()
    early: list[int] = []

    def sleeper(step_ns: int) -> None:
        for k in range(1, 11):
            deadline = start + k * step_ns
            clock.sleep_until(deadline)
            if clock.now_ns() < deadline:
                early.append(deadline)

    threads = [threading.Thread(target=sleeper, args=(step,)) for step in (1 * MS, 3 * MS)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not early


def test_a_paced_world_is_stepped_to_the_grid_and_never_ahead_of_the_time():
    world = World(50 * MS)
    clock = PacedClock(world, step_ns=2 * MS)
    assert clock.now_ns() >= 50 * MS
    for k in range(1, 4):
        deadline = 50 * MS + k * 4 * MS
        clock.sleep_until(deadline)
        assert deadline <= world.now_ns <= clock.now_ns()
        assert (world.now_ns - 50 * MS) % (2 * MS) == 0


def test_a_paced_world_goes_on_without_a_late_loop():
    world = World()
    clock = PacedClock(world, step_ns=1 * MS)
    real = RealClock()
    real.sleep_until(real.now_ns() + 12 * MS)  # the loop overslept its deadline at 4 ms by at least 8 ms
    clock.sleep_until(4 * MS)
    assert world.now_ns >= 12 * MS


def test_what_the_host_does_before_it_begins_does_not_pass_in_the_world():
    world, real = World(50 * MS), RealClock()
    clock = PacedClock(world, step_ns=1 * MS)
    real.sleep_until(real.now_ns() + 10 * MS)
    before = clock.now_ns()
    clock.begin()
    assert before >= 60 * MS
    assert 50 * MS <= clock.now_ns() < before + 10 * MS


def test_a_world_that_cannot_follow_is_counted():
    class Slow(World):
        def step_to(self, time_ns: int) -> None:
            super().step_to(time_ns)
            real.sleep_until(real.now_ns() + 6 * MS)

    real = RealClock()
    clock = PacedClock(Slow(), step_ns=1 * MS)
    clock.sleep_until(2 * MS)
    assert clock.world_late_ns >= 4 * MS - 1 * MS


def test_recordings_without_a_world_are_paced_too():
    clock = PacedClock(None, step_ns=1 * MS)
    clock.sleep_until(5 * MS)
    assert clock.now_ns() >= 5 * MS
