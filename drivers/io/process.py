"""The host's side of a process at the wire: starts it, watches it, restarts it, and is never held up by it."""

from __future__ import annotations

import os
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from drivers.interface.devices import DeviceState
from drivers.interface.errors import DeviceError
from drivers.interface.frame_slot import FrameSlot
from drivers.interface.shared_memory import allocate
from drivers.interface.shared_ring import SharedRing
from drivers.io.backoff import Backoff, BackoffSettings
from drivers.io.channels import Channels, MemorySpec
from drivers.io.child import Task
from drivers.io.child_handle import ChildHandle
from drivers.io.health import HealthRecord

WATCH_S = 0.05
SETTLED_S = 5.0  # a child that lived so long starts a new series of failures
NOTHING = np.zeros(0)


@dataclass(frozen=True, slots=True)
class IoSpec:
    """What a process at the wire is to be."""

    name: str  # of the device in the robot, for messages
    session: str  # "module:Class"
    settings: object  # of the session; pickled
    memory: MemorySpec
    wire: BackoffSettings = field(default_factory=BackoffSettings)  # for a lost wire; the same process tries again
    restart: BackoffSettings = field(default_factory=lambda: BackoffSettings(tries=5))  # for a dead or stuck process
    open_s: float = 10.0  # how long connecting may take
    place: str = ""  # where the device should answer, for the message that it did not
    silent_s: float = 1.0  # a process that has not gone round its loop for so long is stuck, and is killed


class IoProcess:
    """One process at the wire.  Its supervising thread sleeps until the child ends; the loop's calls only touch memory."""

    def __init__(self, spec: IoSpec) -> None:
        """Remember; nothing is started before `open`."""
        self._spec = spec
        self._channels = Channels(spec.memory, None)
        self._thread: threading.Thread | None = None
        self._closing = threading.Event()
        self._reset = threading.Event()
        self._child: ChildHandle | None = None
        self._bell = -1  # an eventfd: unlike a socket or a pipe it does not pull the one who is woken onto the waker's core
        self._word: tuple[DeviceState, str] | None = None  # the host's own, where the child cannot speak
        self._open = False

    def open(self) -> None:
        """Start the child and wait until its session is open; counters begin anew.

        Raises:
            DeviceError: it could not connect, died, or took longer than `open_s`; says why in one sentence.
        """
        self.close()
        spec = self._spec
        size = Channels(spec.memory, None).size
        memory = allocate(size)
        self._bell = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._channels = Channels.shared(spec.memory, memory, size)
        self._closing, self._reset, self._word = threading.Event(), threading.Event(), None
        self._thread = threading.Thread(target=self._supervise, args=(memory, size), name=f"{spec.name} io", daemon=True)
        self._thread.start()
        try:
            self._await_open()
        except BaseException:  # Ctrl-C too
            self.close()
            raise
        self._open = True

    def command(self, values: NDArray[np.float64], expires_ns: int) -> None:
        """Give an order that holds until `expires_ns` on CLOCK_MONOTONIC; it is sent once.

        Raises:
            DeviceError: it is not open.
        """
        if not self._open:
            raise DeviceError(f"{self._spec.name} is not open and takes no commands")
        self._channels.command.write(values, expires_ns)
        self._ring_the_bell()

    def stop(self) -> None:
        """Rest now."""
        if self._thread is not None:
            self._channels.command.write(NOTHING, 0)
            self._ring_the_bell()

    def clear_faults(self) -> None:
        """Pass the operator's reset on, also to a process that was given up."""
        if self._thread is not None:
            self._channels.command.ask_reset()
            self._reset.set()
            self._ring_the_bell()

    def ring(self, name: str) -> SharedRing:
        """Return a ring of samples to drain."""
        return self._channels.rings[name]

    def frame(self, name: str) -> FrameSlot:
        """Return a slot to take the newest frame from."""
        return self._channels.frames[name]

    def health(self) -> HealthRecord:
        """Say how device and process stand; never blocks."""
        record, word = self._channels.health.read(), self._word
        if not self._open:
            return replace(record, state=DeviceState.CLOSED, fault="")
        if word is not None:
            return replace(record, state=word[0], fault=word[1])
        if record.state is DeviceState.FAULTED and record.resets_done < self._channels.command.resets:
            return replace(record, state=DeviceState.RECONNECTING, fault="its faults are being cleared")
        return record

    @property
    def is_open(self) -> bool:
        """Whether it was opened and not closed since, whatever has become of the device."""
        return self._open

    @property
    def pid(self) -> int | None:
        """The child's process id, or None."""
        return None if self._child is None else self._child.pid

    def close(self) -> None:
        """Let the child rest and end; one that does not within its time is killed."""
        self._open = False
        thread, self._thread = self._thread, None
        if thread is not None:
            self._closing.set()
            self._reset.set()
            thread.join()
            os.close(self._bell)

    def _ring_the_bell(self) -> None:
        """Let the child look at the memory now."""
        with suppress(BlockingIOError):  # it has not listened for 2^64 - 2 rings
            os.eventfd_write(self._bell, 1)

    def _await_open(self) -> None:
        spec, deadline_s = self._spec, time.monotonic() + self._spec.open_s
        while True:
            record, word = self._channels.health.read(), self._word
            if record.state in (DeviceState.OPEN, DeviceState.ENDED):  # a recording may be short
                return
            late = time.monotonic() > deadline_s
            if word is not None or record.reconnects or record.state is DeviceState.FAULTED or late:
                nobody = f"{spec.place or 'it'} did not answer within {spec.open_s:g} s"
                fault = (word[1] if word else record.fault) or nobody
                raise DeviceError(fault if fault.startswith(spec.name) else f"{spec.name}: {fault}")
            time.sleep(0.002)

    def _supervise(self, memory: int, size: int) -> None:
        """Keep a child running until closing; runs in the thread, which is also what the child's life is tied to."""
        spec, backoff = self._spec, Backoff(self._spec.restart)
        generation = 0
        try:
            while not self._closing.is_set():
                task = Task(spec.name, spec.session, spec.settings, spec.memory, size, spec.wire, generation)
                generation += 1
                reason = self._run_child(task, memory, backoff)
                pause_s = backoff.failed()
                self._word = (DeviceState.RECONNECTING if pause_s is not None else DeviceState.FAULTED, reason)
                self._reset.clear()
                self._reset.wait(pause_s)
                if pause_s is None:
                    backoff.succeeded()
        finally:
            os.close(memory)

    def _run_child(self, task: Task, memory: int, backoff: Backoff) -> str:
        """Start a child, watch it to its end and return what happened."""
        try:
            child = self._child = ChildHandle(task, memory, self._bell)
        except OSError as error:
            return f"its process could not be started: {error}"
        try:
            began_s = time.monotonic()
            self._channels.health.beat(0)
            self._word = self._word if task.generation else None
            reason = self._watch(child)
            if time.monotonic() - began_s > SETTLED_S:
                backoff.succeeded()
            return reason
        finally:
            self._child = None
            child.end()

    def _watch(self, child: ChildHandle) -> str:
        """Return why the child is no more, or nothing when it is to be ended."""
        seen_s = time.monotonic()
        while not self._closing.is_set():
            if child.ended(WATCH_S, self._closing):
                last = self._channels.health.read()
                return last.fault if last.state is DeviceState.FAULTED and last.fault else child.reason()
            heartbeat_ns, now_s = self._channels.health.heartbeat_ns, time.monotonic()
            if heartbeat_ns:
                seen_s = max(seen_s, heartbeat_ns * 1e-9)
                self._word = None  # it speaks for itself
            if now_s - seen_s > (self._spec.silent_s if heartbeat_ns else self._spec.open_s):
                child.end(patience_s=0.0)
                return f"its process has not answered for {now_s - seen_s:.1f} s"
        return ""
