"""Memory between processes: order, loss, and that nothing half written is ever seen."""

import mmap
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.interface.devices import DeviceState
from drivers.interface.shared_memory import allocate
from drivers.io.channels import Channels, FrameSpec, MemorySpec, RingSpec
from drivers.io.health import HealthRecord

PAIR = np.dtype([("a", "i8"), ("b", "f8")])
WIDE = np.dtype([("n", "i8", (40,))])
SPEC = MemorySpec((RingSpec("pairs", PAIR, 8), RingSpec("wide", WIDE, 16)), (FrameSpec("image", PAIR, 4096),), 5)


@pytest.fixture
def both():
    """Two sides over the same memory."""
    memory = mmap.mmap(-1, Channels(SPEC, None).size)
    return Channels(SPEC, memory), Channels(SPEC, memory)


@given(st.lists(st.integers(0, 20), min_size=1, max_size=12))
def test_a_ring_returns_the_newest_in_order_and_counts_what_it_lost(bursts):
    memory = mmap.mmap(-1, Channels(SPEC, None).size)
    writer, reader = Channels(SPEC, memory).rings["pairs"], Channels(SPEC, memory).rings["pairs"]
    written, lost = 0, 0
    for burst in bursts:
        for _ in range(burst):
            writer.put((written, written / 2))
            written += 1
        got = reader.drain()
        kept = min(burst, 8)
        lost += burst - kept
        assert got["a"].tolist() == list(range(written - kept, written))
        assert got["b"].tolist() == [n / 2 for n in range(written - kept, written)]
        assert reader.overflowed == lost


def test_a_ring_goes_on_after_its_writer_has_died_in_a_record(both):
    here, there = both
    here.rings["pairs"].put((1, 1.0))
    here.rings["pairs"]._words[1] = 2  # announced, never written
    assert there.rings["pairs"].drain()["a"].tolist() == [1]
    assert there.rings["pairs"].drain().size == 0
    here.rings["pairs"].put((2, 2.0))
    assert there.rings["pairs"].drain()["a"].tolist() == [2]


def test_an_order_is_the_newest_one_whole(both):
    here, there = both
    assert there.command.read().sequence == 0
    here.command.write(np.array([1.0, 2.0, 3.0]), 70)
    here.command.write(np.array([4.0, 5.0]), 80)
    order = there.command.read()
    assert (order.sequence, order.expires_ns, order.values.tolist()) == (2, 80, [4.0, 5.0])
    assert there.command.read() is order
    with pytest.raises(ValueError, match="6 values"):
        here.command.write(np.zeros(6), 90)


def test_an_order_whose_writer_stopped_half_way_is_not_seen(both):
    here, there = both
    here.command.write(np.array([1.0]), 70)
    there.command.read()
    here.command._lock.begin()
    here.command._words[0] = 9
    assert there.command.read().sequence == 1
    here.command.write(np.array([2.0]), 71)  # a successor
    assert there.command.read().values.tolist() == [2.0]


def test_a_frame_is_taken_once_and_the_newest_wins(both):
    here, there = both
    slot = there.frames["image"]
    assert slot.take() is None
    for n in range(1, 6):
        here.frames["image"].put((n, 0.5 * n), np.full((4, 3), n, np.uint16))
    meta, raw = slot.take()
    assert (meta["a"], meta["b"]) == (5, 2.5)
    assert raw.view(np.uint16).tolist() == [5] * 12
    assert slot.take() is None
    assert slot.overwritten == 4
    with pytest.raises(ValueError, match="5000 bytes"):
        here.frames["image"].put((0, 0.0), np.zeros(5000, np.uint8))


def test_a_frame_whose_writer_died_in_it_is_not_seen(both):
    here, there = both
    here.frames["image"].put((1, 0.0), np.zeros(8, np.uint8))
    here.frames["image"]._locks[1].begin()
    assert there.frames["image"].take()[0]["a"] == 1
    here.frames["image"]._words[0] += 1
    assert there.frames["image"].take() is None


def test_health_arrives_as_it_was_told(both):
    here, there = both
    assert np.isnan(there.health.read().battery_v)
    told = HealthRecord(DeviceState.FAULTED, "axis 2: zu heiß", 5, 1, 2, 3, battery_v=24.5, firmware="0.6.9", figures=[1.0] * 32)
    here.health.publish(told)
    heard = there.health.read()
    assert (heard.state, heard.fault, heard.received, heard.battery_v, heard.firmware) == (
        DeviceState.FAULTED, "axis 2: zu heiß", 5, 24.5, "0.6.9")  # fmt: skip
    assert heard.figures == [1.0] * 32
    assert there.health.read() is heard


WRITER = """
import sys; sys.path[:] = sys.argv[2:]
import numpy as np
from tests.drivers.interface.test_shared_memory import SPEC
from drivers.io.channels import Channels
channels = Channels.shared(SPEC, int(sys.argv[1]), Channels(SPEC, None).size)
n = 0
while True:
    n += 1
    channels.rings["wide"].put((np.full(40, n),))
    channels.command.write(np.full(5, float(n)), n)
    channels.frames["image"].put((n, n), np.full(2048, n % 30000, np.int16))
"""


def test_nothing_torn_is_seen_from_another_process_and_nothing_hangs_when_it_is_killed():
    memory = allocate(Channels(SPEC, None).size)
    reader = Channels.shared(SPEC, memory, Channels(SPEC, None).size)
    writer = subprocess.Popen([sys.executable, "-c", WRITER, str(memory), *sys.path], pass_fds=(memory,))
    os.close(memory)
    seen, last = 0, 0
    deadline_s = time.monotonic() + 20.0
    try:
        while seen < 3000 and time.monotonic() < deadline_s:
            for record in reader.rings["wide"].drain()["n"]:
                assert (record == record[0]).all()
                assert record[0] > last
                last, seen = record[0], seen + 1
            order = reader.command.read()
            assert (order.values == order.expires_ns).all()
            if (frame := reader.frames["image"].take()) is not None:
                assert (frame[1].view(np.int16) == frame[0]["a"] % 30000).all()
    finally:
        writer.send_signal(signal.SIGKILL)
        writer.wait()
    assert seen >= 3000
    for _ in range(3):
        reader.rings["wide"].drain()
        reader.command.read()
        reader.frames["image"].take()
