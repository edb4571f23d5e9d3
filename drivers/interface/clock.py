"""The one clock.  Nanoseconds, monotonic.  Only a clock and a driver's own reader ask the system for the time.

`RealClock` sleeps to a deadline; `SimClock` steps a simulated world to it, as fast as the machine can;
`PacedClock` does both, so that a simulated world runs in real time and moves on when the loop is late.
"""

import ctypes
import errno
import os
import time
from typing import Protocol


class Clock(Protocol):
    """Tells the time and passes it."""

    def now_ns(self) -> int:
        """Return the time [ns]."""
        ...

    def sleep_until(self, deadline_ns: int) -> None:
        """Return when the time has come; at once when it has passed."""
        ...


class Steppable(Protocol):
    """A world that time can be passed in."""

    @property
    def now_ns(self) -> int:
        """The world's time [ns]."""
        ...

    def step_to(self, time_ns: int) -> None:
        """Simulate up to `time_ns`."""
        ...


class _Timespec(ctypes.Structure):
    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


_TIMER_ABSTIME = 1


class RealClock:
    """CLOCK_MONOTONIC, slept on with an absolute deadline, so that a preempted sleeper does not drift."""

    def __init__(self) -> None:
        """Find `clock_nanosleep` in the C library."""
        self._sleep = ctypes.CDLL(None).clock_nanosleep
        self._sleep.argtypes = (ctypes.c_int, ctypes.c_int, ctypes.POINTER(_Timespec), ctypes.c_void_p)

    def now_ns(self) -> int:
        """Return the host's monotonic time [ns]."""
        return time.monotonic_ns()

    def sleep_until(self, deadline_ns: int) -> None:
        """Sleep to the deadline with `clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME)`; a signal only wakes it to sleep on.

        Raises:
            OSError: the system refused to sleep.
        """
        deadline = _Timespec(*divmod(max(deadline_ns, 0), 1_000_000_000))  # one a call: threads may share a clock
        while error := self._sleep(time.CLOCK_MONOTONIC, _TIMER_ABSTIME, deadline, None):
            if error != errno.EINTR:  # Python runs its signal handler between bytecodes, then we sleep on
                raise OSError(error, os.strerror(error))


class SimClock:
    """The time of a simulated world: sleeping is simulating.  Without a world (recordings only) time jumps."""

    def __init__(self, world: Steppable | None = None) -> None:
        """Start at the world's time, or at zero."""
        self._world = world
        self._now_ns = 0 if world is None else world.now_ns

    def now_ns(self) -> int:
        """Return the simulated time [ns]."""
        return self._now_ns

    def sleep_until(self, deadline_ns: int) -> None:
        """Simulate up to the deadline."""
        if deadline_ns <= self._now_ns:
            return
        if self._world is not None:
            self._world.step_to(deadline_ns)
        self._now_ns = deadline_ns


class PacedClock:
    """A simulated world in real time: sleeps to the deadline, then brings the world up to where the time really is.

    A late loop finds that the world has gone on without it, its command expired.
    """

    def __init__(self, world: Steppable | None, step_ns: int) -> None:
        """Anchor the world's time to the host's; `step_ns` is the grid that the world is stepped on."""
        self._real = RealClock()
        self._world = world
        self._step_ns = step_ns
        self.world_late_ns = 0  # for how long in all deadlines had passed before the world had been stepped to them
        self.begin()

    def begin(self) -> None:
        """Go on from the world's time now: what the host spent since the last step (on compiling, say) has not passed in it."""
        self._anchor_ns = self._real.now_ns() - (0 if self._world is None else self._world.now_ns)

    def now_ns(self) -> int:
        """Return the host's time since the anchor, on the world's scale [ns]."""
        return self._real.now_ns() - self._anchor_ns

    def sleep_until(self, deadline_ns: int) -> None:
        """Sleep to the deadline, then simulate up to now (at least up to the deadline)."""
        if self._world is None:
            self._real.sleep_until(deadline_ns + self._anchor_ns)
            return
        began_ns = self.now_ns()
        self._world.step_to(deadline_ns - self._step_ns)  # most of the work before the deadline, not after it
        self.world_late_ns += max(0, self.now_ns() - max(deadline_ns, began_ns))
        self._real.sleep_until(deadline_ns + self._anchor_ns)
        late_ns = max(0, self.now_ns() - deadline_ns)
        self._world.step_to(deadline_ns + late_ns // self._step_ns * self._step_ns)
