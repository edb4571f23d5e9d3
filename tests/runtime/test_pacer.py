"""The beat, on a virtual clock: exact, no waiting."""

from itertools import islice

import pytest

from drivers.interface.clock import SimClock
from runtime.pacer import Pacer

MS = 1_000_000


class VirtualClock:
    """Time that passes only when somebody works or sleeps; waking takes `wake_ns`."""

    def __init__(self, wake_ns: int = 0) -> None:
        self.time_ns = 1_000 * MS
        self.wake_ns = wake_ns

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = max(self.time_ns, deadline_ns + self.wake_ns)


def beat(work_ms: list[float], wake_ns: int = 0) -> list:
    clock = VirtualClock(wake_ns)
    ticks = []
    for tick, work in zip(Pacer(clock, 10 * MS, lockstep=False), work_ms, strict=False):
        ticks.append(tick)
        clock.time_ns += round(work * MS)
    return ticks


def test_the_grid_is_absolute_however_long_the_work_takes_within_a_period() -> None:
    ticks = beat([1, 9.5, 3, 0.1, 7, 0], wake_ns=200_000)
    assert [t.start_ns - ticks[0].start_ns for t in ticks] == [k * 10 * MS for k in range(6)]
    assert [t.index for t in ticks] == list(range(6))
    assert [t.skipped for t in ticks] == [0] * 6
    assert all(t.lateness_ns == 200_000 for t in ticks[1:])


def test_a_late_tick_is_skipped_and_counted_and_the_next_is_back_on_the_grid() -> None:
    ticks = beat([1, 34, 1, 1])
    assert [t.skipped for t in ticks] == [0, 0, 3, 0]
    assert [t.index for t in ticks] == [0, 1, 5, 6]
    assert [(t.start_ns - ticks[0].start_ns) // MS for t in ticks] == [0, 10, 50, 60]


def test_work_that_ends_exactly_on_the_next_deadline_misses_nothing() -> None:
    assert [t.skipped for t in beat([10, 10.000001, 1])] == [0, 0, 1]


def test_the_last_work_is_handed_on_as_an_input() -> None:
    assert [t.last_work_ns for t in beat([2, 25, 1])] == [0, 2 * MS, 25 * MS]


def test_in_lockstep_a_model_takes_the_place_of_the_measurement() -> None:
    pacer = Pacer(SimClock(), 10 * MS, lockstep=True, model_work_ns=23 * MS, model_plan_ns=20 * MS)
    ticks = list(islice(pacer, 3))
    assert [t.skipped for t in ticks] == [0, 2, 2]
    assert [t.index for t in ticks] == [0, 3, 6]
    assert ticks[2].last_plan_ns == 20 * MS
    assert all(t.lateness_ns == 0 for t in ticks)
    assert pacer.missed == 4


def test_a_period_must_be_positive() -> None:
    with pytest.raises(ValueError, match="positive"):
        Pacer(SimClock(), 0, lockstep=True)
