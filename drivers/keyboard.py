"""The person in charge, at the keyboard of the terminal that the robot was started from."""

import os
import select
import sys
import termios
import threading
import tty
from typing import Any, ClassVar

from pydantic import Field

from drivers.interface.buffers import SampleRing
from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceHealth, DeviceSetup, DeviceState
from drivers.interface.errors import DeviceError
from drivers.interface.samples import (
    EmergencyStop,
    Jog,
    OperatorAction,
    OperatorEvent,
    ResetFaults,
    SetEnabled,
    SetPaused,
    Stamp,
)
from drivers.interface.settings import Settings

# What a key asks for along (vx, wz).  A terminal sends an arrow as ESC [ A..D, or ESC O A..D in application mode.
_JOG = {
    b"w": (1.0, 0.0), b"s": (-1.0, 0.0), b"a": (0.0, 1.0), b"d": (0.0, -1.0),
    b"A": (1.0, 0.0), b"B": (-1.0, 0.0), b"D": (0.0, 1.0), b"C": (0.0, -1.0),
}  # fmt: skip


class KeyboardSettings(Settings):
    """How fast a jog is, and how long one key press lasts."""

    jog_speed_m_s: float = Field(0.2, gt=0.0, le=2.0, description="speed of a jog forward or back")
    jog_turn_rad_s: float = Field(0.5, gt=0.0, le=5.0, description="rate of a jog turn")
    jog_expires_s: float = Field(0.3, gt=0.0, le=2.0, description="a key held down repeats; this long after the last one it ends")
    enabled: bool = Field(True, description="whether the robot may move before the first key press")


class KeyboardOperator:
    """The keyboard of the terminal that the robot was started from.

    It reads single keys in its own thread: space e-stop, r reset, p pause or resume, e enable or disable, arrows or wasd jog.

    An unknown key does nothing.  `close` gives the terminal back as it was.  Ctrl-C stays what it is.
    """

    Settings: ClassVar[type[Settings]] = KeyboardSettings
    role: ClassVar[str] = "operator"
    real_time: ClassVar[bool] = True  # a person cannot be simulated faster than he types

    def __init__(self, settings: KeyboardSettings, setup: DeviceSetup, descriptor: int | None = None) -> None:
        """Remember; `descriptor` is the terminal to read, standard input if None."""
        self._settings = settings
        self._setup = setup
        self._descriptor = descriptor
        self._ring: SampleRing[OperatorEvent] = SampleRing(256)
        self._saved: list[Any] | None = None  # the terminal's attributes before us
        self._thread: threading.Thread | None = None
        self._wake: tuple[int, int] | None = None  # a pipe that ends the thread's wait
        self._enabled, self._paused = settings.enabled, False
        self._sequence = 0
        self._fault = ""

    def open(self) -> None:
        """Take over the terminal and start to listen.

        Raises:
            DeviceError: there is no terminal.
        """
        self.close()
        self._fault = ""
        self._sequence = 0
        self._ring = SampleRing(256)  # what was typed before it was closed is over
        self._enabled, self._paused = self._settings.enabled, False
        descriptor = self._terminal()
        self._saved = termios.tcgetattr(descriptor)
        tty.setcbreak(descriptor, termios.TCSANOW)
        self._wake = os.pipe()
        self._act(SetEnabled(self._enabled))
        self._thread = threading.Thread(target=self._listen, args=(descriptor, self._wake[0]), name="keyboard", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Do nothing: a person does not move the robot by being asked to stop."""

    def close(self) -> None:
        """Stop listening and give the terminal back."""
        if self._wake is not None and self._thread is not None:
            os.write(self._wake[1], b"\0")
            self._thread.join()
        if self._saved is not None:
            self._restore_terminal(self._saved)
        for end in self._wake or ():
            os.close(end)
        self._thread = self._wake = self._saved = None

    def drain(self) -> tuple[OperatorEvent, ...]:
        """Return every action since the last call, oldest first; none when closed."""
        return () if self._thread is None else self._ring.drain()

    def health(self) -> DeviceHealth:
        """Say how it stands; the terminal's end is a fault, since the person is then out of reach."""
        open_state = DeviceState.FAULTED if self._fault else DeviceState.OPEN
        state = DeviceState.CLOSED if self._thread is None else open_state
        return DeviceHealth(self._setup.name, state, self._fault, received=self._sequence, overflowed=self._ring.overflowed)

    def _terminal(self) -> int:
        try:
            descriptor = sys.stdin.fileno() if self._descriptor is None else self._descriptor
            if os.isatty(descriptor):
                return descriptor
        except (OSError, ValueError, AttributeError):  # standard input is closed, replaced or None
            pass
        raise DeviceError(f"{self._setup.name}: the keyboard operator needs a terminal, and standard input is not one")

    def _restore_terminal(self, attributes: list[Any]) -> None:
        try:
            termios.tcsetattr(self._terminal(), termios.TCSANOW, attributes)
        except (DeviceError, termios.error):
            self._fault = "the terminal is gone"  # nothing is left to restore

    def _listen(self, descriptor: int, wake: int) -> None:
        """Read keys until woken; runs in the thread."""
        while True:
            readable, _, _ = select.select((descriptor, wake), (), ())
            if wake in readable:
                return
            try:
                keys = os.read(descriptor, 64)
            except OSError:  # EIO: the other side hung up
                keys = b""
            if not keys:
                self._fault = "the terminal has been closed"
                return
            self._interpret(keys)

    def _interpret(self, keys: bytes) -> None:
        """Act on a burst of key codes."""
        while keys:
            arrow = keys[:2] in (b"\x1b[", b"\x1bO")
            code, keys = (keys[2:3], keys[3:]) if arrow else (keys[:1], keys[1:])
            action = self._jog(code) if arrow or code in b"wasd" else self._switch(code)
            if action is not None:
                self._act(action)

    def _jog(self, code: bytes) -> OperatorAction | None:
        if code not in _JOG:
            return None
        along, turn = _JOG[code]
        s = self._settings
        twist = BodyTwist(along * s.jog_speed_m_s, 0.0, turn * s.jog_turn_rad_s)
        return Jog(twist, self._setup.now_ns() + round(s.jog_expires_s * 1e9))

    def _switch(self, code: bytes) -> OperatorAction | None:
        match code:
            case b" ":
                return EmergencyStop()
            case b"r":
                return ResetFaults()
            case b"p":
                self._paused = not self._paused
                return SetPaused(self._paused)
            case b"e":
                self._enabled = not self._enabled
                return SetEnabled(self._enabled)
            case _:
                return None

    def _act(self, action: OperatorAction) -> None:
        now_ns = self._setup.now_ns()
        self._ring.put(OperatorEvent(Stamp(now_ns, now_ns, self._sequence), action))
        self._sequence += 1
