"""The keyboard over a pseudo-terminal: what is written to its master end is what a person types."""

import contextlib
import io
import os
import pty
import termios
from threading import Event

import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceSetup, DeviceState, Operator
from drivers.interface.errors import DeviceError
from drivers.interface.samples import EmergencyStop, Jog, ResetFaults, SetEnabled, SetPaused
from drivers.keyboard import KeyboardOperator, KeyboardSettings

NOW_NS = 1_000_000_000


@pytest.fixture
def terminal():
    master, slave = pty.openpty()
    yield master, slave
    for descriptor in (master, slave):
        with contextlib.suppress(OSError):  # a test may have hung up
            os.close(descriptor)


def keyboard(descriptor: int | None, **settings: object) -> KeyboardOperator:
    return KeyboardOperator(KeyboardSettings(**settings), DeviceSetup("operator", 0, lambda: NOW_NS), descriptor)


def actions_until(device: KeyboardOperator, wanted: int) -> list[object]:
    """Drain until so many actions came; gives the reader's thread ten seconds at most."""
    actions: list[object] = []
    for _ in range(10_000):
        actions += [event.action for event in device.drain()]
        if len(actions) >= wanted:
            return actions
        Event().wait(0.001)
    pytest.fail(f"only {actions} came")


def typed(terminal: tuple[int, int], keys: bytes, wanted: int, **settings: object) -> list[object]:
    device = keyboard(terminal[1], **settings)
    device.open()
    try:
        os.write(terminal[0], keys)
        return actions_until(device, wanted + 1)[1:]  # the first says whether the robot may move
    finally:
        device.close()


def test_every_key_does_what_it_says(terminal):
    assert isinstance(keyboard(None), Operator)
    expected = [EmergencyStop(), ResetFaults(), SetPaused(True), SetPaused(False), SetEnabled(False), SetEnabled(True)]
    assert typed(terminal, b" rppee", 6) == expected


def test_letters_and_arrows_jog_and_expire(terminal):
    keys = b"wsad" + b"\x1b[A\x1b[B\x1b[D\x1b[C" + b"\x1bOA"
    jogs = typed(terminal, keys, 9, jog_speed_m_s=0.25, jog_turn_rad_s=0.75, jog_expires_s=0.4)
    ahead, back = BodyTwist(0.25), BodyTwist(-0.25)
    left, right = BodyTwist(wz=0.75), BodyTwist(wz=-0.75)
    twists = [ahead, back, left, right] * 2 + [ahead]
    assert jogs == [Jog(twist, NOW_NS + 400_000_000) for twist in twists]


def test_unknown_keys_do_nothing(terminal):
    assert typed(terminal, b"xyzABCD\x1b[3~\xc3\xa4 ", 1) == [EmergencyStop()]


def test_it_says_on_opening_whether_the_robot_may_move(terminal):
    for enabled in (True, False):
        device = keyboard(terminal[1], enabled=enabled)
        device.open()
        assert [event.action for event in device.drain()] == [SetEnabled(enabled)]
        device.close()


def test_the_terminal_is_given_back_as_it_was(terminal):
    before = termios.tcgetattr(terminal[1])
    device = keyboard(terminal[1])
    device.open()
    during = termios.tcgetattr(terminal[1])
    assert not during[3] & (termios.ICANON | termios.ECHO)
    assert during[3] & termios.ISIG  # Ctrl-C still interrupts
    device.close()
    assert termios.tcgetattr(terminal[1]) == before


@pytest.mark.parametrize("rounds", [1, 2])
def test_stop_and_close_work_in_every_state(terminal, rounds):
    before = termios.tcgetattr(terminal[1])
    device = keyboard(terminal[1])
    for act in (lambda: None, device.open, device.drain):
        act()
        for _ in range(rounds):
            device.stop()
            device.close()
        assert device.health().state is DeviceState.CLOSED
        assert termios.tcgetattr(terminal[1]) == before
    device.open()
    device.open()  # also twice
    assert device.health().state is DeviceState.OPEN
    device.close()
    assert termios.tcgetattr(terminal[1]) == before


def test_a_hung_up_terminal_is_a_fault(terminal):
    device = keyboard(terminal[1])
    device.open()
    os.close(terminal[0])
    device._thread.join(timeout=10.0)
    health = device.health()
    assert (health.state, health.fault) == (DeviceState.FAULTED, "the terminal has been closed")
    device.close()
    device.close()
    assert device.health().state is DeviceState.CLOSED


def test_without_a_terminal_it_refuses_in_a_sentence(monkeypatch):
    read, write = os.pipe()
    device = keyboard(read)
    with pytest.raises(DeviceError, match="operator: the keyboard operator needs a terminal"):
        device.open()
    device.stop()
    device.close()
    os.close(read)
    os.close(write)
    for stdin in (io.StringIO("r"), None):
        monkeypatch.setattr("sys.stdin", stdin)
        with pytest.raises(DeviceError, match="needs a terminal"):
            keyboard(None).open()
