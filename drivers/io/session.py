"""The contract of what only the process at the wire knows: one device's protocol, without process, thread or clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.interface.frame_slot import FrameSlot
from drivers.interface.shared_ring import SharedRing
from drivers.io.channels import Channels, MemorySpec
from drivers.io.health import HealthRecord


@dataclass(slots=True)
class Port:
    """Where a session leaves what it has for the loop."""

    name: str  # of the device in the robot
    rings: Mapping[str, SharedRing]
    frames: Mapping[str, FrameSlot]
    health: HealthRecord
    reopened: bool = False  # the wire was lost, or an earlier process died: what moves waits for `clear_faults` to arm again


def local_port(memory: MemorySpec, name: str = "device") -> Port:
    """Return a port in this process's own memory, for a session that is tested without a process."""
    channels = Channels.private(memory)
    return Port(name, channels.rings, channels.frames, HealthRecord())


class Session(Protocol):
    """A device's protocol on its wire.  Built as `MySession(settings, port)`; the shell calls everything from one thread.

    Every method may raise `DeviceError` or `OSError` for a lost wire: the shell then rests and closes the session and opens
    it again with back-off.  Any other exception is a bug: it ends the process, and the host starts another.
    """

    def open(self) -> None:
        """Connect, and say OPEN in `port.health.state` (or FAULTED, with a sentence) as soon as that is known; may block."""
        ...

    def wakes_on(self) -> tuple[int, ...]:
        """Return the file descriptors that become readable when something has arrived; none for a `poll` that waits itself."""
        ...

    def next_ns(self, now_ns: int) -> int:
        """Return when `poll` is due even if nothing arrives; `now_ns` for at once."""
        ...

    def poll(self, now_ns: int) -> None:
        """Take in all that has arrived and do what is due; never waits longer than a few milliseconds."""
        ...

    def send(self, values: NDArray[np.float64], now_ns: int) -> None:
        """Send one fresh order; called once for each."""
        ...

    def rest(self) -> None:
        """Send zero (or disarm) now: the order has expired, the runtime is gone, or the robot was stopped."""
        ...

    def clear_faults(self) -> None:
        """Do what the operator's reset asks: clear the device's errors, arm again; may take effect later."""
        ...

    def close(self) -> None:
        """Let go of the wire, also half open and after an error."""
        ...
