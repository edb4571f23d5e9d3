from threading import Thread

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.interface.buffers import NewestSlot, SampleRing


@given(st.integers(1, 6), st.lists(st.one_of(st.none(), st.integers()), max_size=40))
def test_the_ring_agrees_with_an_unbounded_list(capacity, operations):
    """An integer is put; None drains."""
    ring: SampleRing[int] = SampleRing(capacity)
    waiting: list[int] = []
    lost = 0
    for operation in operations:
        if operation is None:
            assert ring.drain() == tuple(waiting)
            waiting = []
        else:
            ring.put(operation)
            waiting.append(operation)
            if len(waiting) > capacity:
                waiting.pop(0)
                lost += 1
    assert ring.drain() == tuple(waiting)
    assert ring.overflowed == lost


@given(st.lists(st.one_of(st.none(), st.integers()), max_size=40))
def test_the_slot_holds_the_newest_and_counts_the_rest(operations):
    """An integer is put; None takes."""
    slot: NewestSlot[int] = NewestSlot()
    put = taken = 0
    newest: int | None = None
    for operation in operations:
        if operation is None:
            assert slot.take() == newest
            taken += newest is not None
            newest = None
        else:
            slot.put(operation)
            put += 1
            newest = operation
    assert slot.overwritten == put - taken - (newest is not None)


def test_nothing_is_lost_or_doubled_between_threads():
    ring: SampleRing[int] = SampleRing(100_000)
    writers = [Thread(target=lambda start=start: [ring.put(start + k) for k in range(5_000)]) for start in (0, 5_000)]
    for writer in writers:
        writer.start()
    got: list[int] = []
    while any(writer.is_alive() for writer in writers):
        got += ring.drain()
    got += ring.drain()
    assert sorted(got) == list(range(10_000))
    assert [k for k in got if k < 5_000] == list(range(5_000))  # each writer's order is kept


@pytest.mark.parametrize("capacity", [0, -1])
def test_a_ring_of_no_capacity_is_refused(capacity):
    with pytest.raises(ValueError, match="at least one"):
        SampleRing(capacity)
