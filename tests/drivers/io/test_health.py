"""What a process said of itself outlives it, whenever it dies."""

import mmap

import pytest

from drivers.interface.shared_memory import Block, Seqlock
from drivers.io.health import HealthBlock, HealthRecord


class Killed(BaseException):
    """The process is no more."""


@pytest.fixture
def memory():
    counted = Block(None)
    HealthBlock(counted)
    return mmap.mmap(-1, counted.size)


@pytest.mark.parametrize("step", ["begin", "end"])
@pytest.mark.parametrize("before", [1, 2])
def test_a_successor_goes_on_from_the_last_whole_record_of_one_killed_while_it_wrote(memory, monkeypatch, before, step):
    host, child = HealthBlock(Block(memory)), HealthBlock(Block(memory))
    for count in range(before):
        child.publish(HealthRecord(received=count + 1, resets_done=3))
    blow = Seqlock.begin if step == "begin" else lambda lock: None

    def killed(lock):
        blow(lock)
        raise Killed

    with monkeypatch.context() as patch:
        patch.setattr(Seqlock, step, killed)
        with pytest.raises(Killed):
            child.publish(HealthRecord(received=99))
    successor = HealthBlock(Block(memory))
    record = successor.read()
    assert (record.received, record.resets_done) == (before, 3)
    assert host.read().received == before
    for received in (10, 11, 12):
        successor.publish(HealthRecord(received=received))
        assert host.read().received == received
        assert host.read() is host.read()
