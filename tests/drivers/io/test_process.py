"""A process at the wire: it rests whenever it must, comes back by itself, and never holds up the host."""

import os
import signal
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from drivers.interface.devices import DeviceState
from drivers.interface.errors import DeviceError
from drivers.io.backoff import BackoffSettings
from drivers.io.process import IoProcess, IoSpec
from tests.drivers.io.toy import MEMORY, ToySettings

QUICK = BackoffSettings(first_s=0.02, longest_s=0.05, tries=2)
LONG_NS = 10**10


class Toy:
    """The other end of the toy's wire."""

    def __init__(self, folder):
        self.path = str(folder / "toy")
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._listener.bind(self.path)
        self._listener.listen()
        self._listener.settimeout(20.0)
        self.wire = None

    def accept(self):
        if self.wire is not None:
            self.wire.close()
        self.wire, _ = self._listener.accept()
        self.wire.settimeout(20.0)
        assert self.hear() == b"open"

    def hear(self):
        return self.wire.recv(256)

    def close(self):
        self._listener.close()
        if self.wire is not None:
            self.wire.close()


@pytest.fixture
def toy(tmp_path):
    toy = Toy(tmp_path)
    yield toy
    toy.close()


@pytest.fixture
def io(toy):
    io = process(toy)
    yield io
    io.close()


def process(toy, **changes):
    settings = ToySettings(path=toy.path, hang=changes.pop("hang", ""), rest_s=changes.pop("rest_s", 0.0))
    return IoProcess(IoSpec("toy", "tests.drivers.io.toy:ToySession", settings, MEMORY, wire=QUICK, restart=QUICK, **changes))


def opened(io, toy):
    io.open()
    toy.accept()
    return io


def until(condition, seconds=20.0):
    deadline_s = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < deadline_s
        time.sleep(0.002)
    return value


def later_ns(seconds):
    return time.monotonic_ns() + round(seconds * 1e9)


def test_samples_come_and_orders_go_and_rest_follows(io, toy):
    opened(io, toy)
    for value in (1.5, 2.5):
        toy.wire.send(struct.pack("<d", value))
    until(lambda: io.health().received == 2)
    got = io.ring("samples").drain()
    assert got["value"].tolist() == [1.5, 2.5]
    assert (np.abs(got["captured_ns"] - time.monotonic_ns()) < LONG_NS).all()
    io.command(np.array([0.3, 0.4]), later_ns(0.2))
    assert toy.hear() == b"order " + np.array([0.3, 0.4]).tobytes()
    assert toy.hear() == b"rest"  # it expired
    assert until(lambda: io.health().expired_commands) == 1
    io.command(np.array([0.5]), later_ns(60.0))
    io.stop()
    heard = [toy.hear()]
    assert (heard if heard == [b"rest"] else [toy.hear()]) == [b"rest"]
    assert io.health().expired_commands == 1


def test_it_rests_before_it_closes_and_closes_in_every_state(io, toy):
    for _ in range(2):
        io.stop()
        io.close()
        assert io.health().state is DeviceState.CLOSED
    with pytest.raises(DeviceError, match="toy is not open"):
        io.command(np.zeros(1), later_ns(1.0))
    opened(io, toy)
    pid = io.pid
    io.close()
    io.close()
    assert toy.hear() == b"rest"
    assert io.health().state is DeviceState.CLOSED
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
    opened(io, toy)
    assert io.health().state is DeviceState.OPEN


def test_it_says_in_one_sentence_why_it_cannot_open(toy):
    toy.path += " that is not there"
    with pytest.raises(DeviceError, match=r"toy: .*No such file"):
        process(toy).open()


def test_a_lost_wire_is_opened_again_and_waits_for_the_operator(io, toy):
    opened(io, toy)
    pid = io.pid
    toy.wire.send(b"x")
    toy.accept()
    health = until(lambda: io.health().state is DeviceState.FAULTED and io.health())
    assert (health.fault, health.reconnects) == ("it waits for a reset", 1)
    io.clear_faults()
    until(lambda: io.health().state is DeviceState.OPEN)
    assert io.pid == pid


def test_an_order_given_while_the_wire_was_down_is_not_sent_when_it_is_up_again(io, toy):
    opened(io, toy)
    toy._listener.close()
    toy.wire.send(b"x")
    until(lambda: io.health().state is DeviceState.RECONNECTING)
    assert io.health().fault
    io.command(np.array([1.0]), later_ns(60.0))
    until(lambda: io.health().state is DeviceState.FAULTED)  # after the tries it may
    os.unlink(toy.path)
    again = Toy(Path(toy.path).parent)
    try:
        io.clear_faults()  # another series of tries
        again.accept()
        again.wire.send(struct.pack("<d", 1.0))
        until(lambda: io.health().received)
        io.command(np.array([2.0]), later_ns(60.0))
        assert again.hear() == b"order " + np.array([2.0]).tobytes()
    finally:
        again.close()


@pytest.mark.parametrize(("blow", "why"), [("kill", "SIGKILL"), ("bug", "ZeroDivisionError: a bug")])
def test_a_dead_process_is_replaced_and_its_counters_go_on(io, toy, blow, why, capfd):
    opened(io, toy)
    toy.wire.send(struct.pack("<d", 1.0))
    until(lambda: io.health().received == 1)
    pid = io.pid
    os.kill(pid, signal.SIGKILL) if blow == "kill" else toy.wire.send(b"bug")
    health = until(lambda: io.health().state is DeviceState.RECONNECTING and io.health())
    assert why in health.fault
    toy.accept()
    assert until(lambda: io.health().state is DeviceState.FAULTED and io.health()).fault == "it waits for a reset"
    toy.wire.send(struct.pack("<d", 2.0))
    until(lambda: io.health().received == 2)
    assert io.ring("samples").drain()["value"].tolist() == [1.0, 2.0]
    assert io.pid != pid
    capfd.readouterr()


@pytest.mark.parametrize("how", ["hang", "stop"])
def test_a_stuck_process_is_killed_and_replaced(toy, how):
    io = process(toy, silent_s=0.3)
    try:
        opened(io, toy)
        toy.wire.send(b"hang") if how == "hang" else os.kill(io.pid, signal.SIGSTOP)
        health = until(lambda: io.health().state is DeviceState.RECONNECTING and io.health())
        assert "has not answered" in health.fault
        toy.accept()
    finally:
        io.close()


def test_what_hangs_in_its_close_is_killed(toy):
    io = process(toy, hang="close")
    opened(io, toy)
    pid = io.pid
    io.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_no_signal_keeps_it_from_resting(toy):
    """The one that tells of the runtime's death may come while the lifeline's end is already being acted upon."""
    io = process(toy, rest_s=0.3)
    try:
        pid = opened(io, toy).pid
        io.command(np.array([1.0]), later_ns(60.0))
        assert toy.hear().startswith(b"order")
        for _ in range(10):
            os.kill(pid, signal.SIGTERM)
            time.sleep(0.01)
        assert toy.hear() == b"rest"
    finally:
        io.close()


HOST = """
import sys, time; sys.path[:] = sys.argv[2:]
import numpy as np
from pathlib import Path
from tests.drivers.io.test_process import process
class Where: path = sys.argv[1]
io = process(Where)
io.open()
print(io.pid, flush=True)
while True:
    io.command(np.array([1.0]), time.monotonic_ns() + 200_000_000)
    time.sleep(0.02)
"""


@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM])
def test_when_the_runtime_is_gone_or_stands_still_the_wire_is_at_rest(toy, blow):
    host = subprocess.Popen([sys.executable, "-c", HOST, toy.path, *sys.path], stdout=subprocess.PIPE, text=True)
    try:
        toy.accept()
        pid = int(host.stdout.readline())
        while not toy.hear().startswith(b"order"):
            pass
        host.send_signal(blow)
        while toy.hear() != b"rest":  # at most the orders that were under way
            pass
        if blow is not signal.SIGSTOP:
            until(lambda: not os.path.exists(f"/proc/{pid}"))
    finally:
        host.kill()
        host.wait()
        host.stdout.close()
    until(lambda: not os.path.exists(f"/proc/{pid}"))
