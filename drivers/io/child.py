"""The process at the wire: a thin shell that opens the session, lets it work, and sends zero when it must.

It is started as a program of its own, so it imports the session's module and nothing else of ours; what it is to do comes as a
pickled `Task` through the lifeline, a socket whose end of file says that the runtime is gone.
"""

from __future__ import annotations

import faulthandler
import importlib
import os
import pickle
import select
import signal
import socket
import struct
import time
import traceback
from contextlib import suppress
from dataclasses import dataclass

from drivers.interface.devices import DeviceState
from drivers.interface.errors import TrundleError
from drivers.io.backoff import Backoff, BackoffSettings
from drivers.io.channels import Channels, MemorySpec
from drivers.io.last_hop import LastHop
from drivers.io.parent import end_with_parent
from drivers.io.session import Port, Session

PUBLISH_NS = 50_000_000  # health goes out at least this often, and at every change of state
HEARTBEAT_S = 0.1  # no wait is longer
LAST_WORDS_S = 2.0  # for rest and close when the runtime is gone; then it ends, whatever hangs


@dataclass(frozen=True, slots=True)
class Task:
    """What a child is told."""

    name: str
    session: str  # "module:Class"
    settings: object
    memory: MemorySpec
    size: int
    backoff: BackoffSettings
    generation: int  # how many children had this task before


class Shell:
    """Runs one session until the lifeline ends."""

    def __init__(self, task: Task, channels: Channels, lifeline: socket.socket, bell: int) -> None:
        """Take over where an earlier child stopped: its counters, its records, the orders it saw."""
        self._channels = channels
        self._lifeline = lifeline.fileno()
        self._bell = bell
        self._health = channels.health.read()
        self._health.fault, self._health.state = "", DeviceState.RECONNECTING
        self._port = Port(task.name, channels.rings, channels.frames, self._health, task.generation > 0)
        module, _, name = task.session.partition(":")
        self._session: Session = getattr(importlib.import_module(module), name)(task.settings, self._port)
        self._hop = LastHop(self._session, self._health, channels.command.read().sequence)
        self._resets = channels.command.resets
        self._backoff = Backoff(task.backoff)
        self._published: tuple[int, DeviceState, str, int] = (0, DeviceState.CLOSED, "", 0)
        self._alive = True
        self._nowhere = open(os.devnull, "w")  # noqa: SIM115 - for as long as the process lives

    def run(self) -> None:
        """Work until the runtime wants no more, or is no more; a lost wire is opened again with back-off."""
        self._publish(time.monotonic_ns())
        try:
            while self._alive:
                try:
                    self._open()
                    self._serve()
                except (TrundleError, OSError) as error:
                    self._lose(error)
        except Exception as error:
            self._health.state, self._health.fault = DeviceState.FAULTED, f"{type(error).__name__}: {error}"
            raise
        finally:
            self._end_soon()
            self._leave()
            self._publish(time.monotonic_ns())
            faulthandler.cancel_dump_traceback_later()

    def end(self, signal_number: int, frame: object) -> None:
        """Leave as soon as the call under way returns.

        It raises nothing: the signal that tells of the runtime's death comes at the same time as the lifeline's end, and an
        exception would cut short the very call that sends zero.
        """
        self._alive = False
        self._end_soon()  # in case that call never returns
        with suppress(BlockingIOError):
            os.eventfd_write(self._bell, 1)

    def _end_soon(self) -> None:
        """Let the process end after its last words, whatever hangs."""
        faulthandler.dump_traceback_later(LAST_WORDS_S, exit=True, file=self._nowhere)

    def _open(self) -> None:
        self._channels.health.beat(0)  # this may take its time
        self._session.open()
        if self._health.state is DeviceState.OPEN:  # until then the fault says why it was lost
            self._health.fault = ""
        self._backoff.succeeded()

    def _serve(self) -> None:
        session, command = self._session, self._channels.command
        while True:
            now_ns = time.monotonic_ns()
            session.poll(now_ns)
            self._hop.step(command.read(), time.monotonic_ns())
            if command.resets != self._resets:
                self._resets = command.resets
                session.clear_faults()
                self._health.resets_done = self._resets
            self._publish(now_ns)
            due_ns = min(session.next_ns(now_ns), self._hop.ends_ns)
            if not self._wait((due_ns - time.monotonic_ns()) * 1e-9, session.wakes_on()):
                return

    def _wait(self, seconds: float, descriptors: tuple[int, ...] = ()) -> bool:
        """Wait for the wire, a new order or so much time; return whether the runtime still wants us."""
        wait_s = min(max(seconds, 0.0), HEARTBEAT_S)
        readable, _, _ = select.select((self._lifeline, self._bell, *descriptors), (), (), wait_s)
        if self._bell in readable:
            os.eventfd_read(self._bell)
        if self._lifeline in readable:
            self._alive = False
        return self._alive

    def _lose(self, error: Exception) -> None:
        """Say why, let go, and wait."""
        self._leave()
        pause_s = self._backoff.failed()
        self._health.state = DeviceState.FAULTED if pause_s is None else DeviceState.RECONNECTING
        self._health.fault = str(error) or type(error).__name__
        self._health.reconnects += 1
        self._port.reopened = True
        self._publish(time.monotonic_ns())
        until_ns = time.monotonic_ns() + round((pause_s or 0.0) * 1e9)
        asked = self._resets
        while self._wait((until_ns - time.monotonic_ns()) * 1e-9 if pause_s is not None else HEARTBEAT_S):
            now_ns = time.monotonic_ns()
            self._publish(now_ns)
            self._hop.forget(self._channels.command.read())
            if pause_s is None:
                if self._channels.command.resets != asked:  # the operator wants another series of tries
                    self._backoff.succeeded()
                    return
            elif now_ns >= until_ns:
                return

    def _leave(self) -> None:
        """Rest and close, as far as the wire still allows."""
        with suppress(TrundleError, OSError):
            self._hop.rest()
        with suppress(TrundleError, OSError):
            self._session.close()

    def _publish(self, now_ns: int) -> None:
        health = self._health
        self._channels.health.beat(now_ns)
        last_ns, state, fault, resets = self._published
        if now_ns - last_ns >= PUBLISH_NS or (state, fault, resets) != (health.state, health.fault, health.resets_done):
            self._channels.health.publish(health)
            self._published = (now_ns, health.state, health.fault, health.resets_done)


def main(lifeline_fd: int, memory_fd: int, bell_fd: int) -> None:
    """Be the child: take the task, work, and leave with the runtime."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the runtime's; it tells us
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # until there is something to bring to rest
    end_with_parent()  # should the lifeline have leaked into another process
    lifeline = socket.socket(fileno=lifeline_fd)
    task = _receive(lifeline)
    if task is None:
        return  # the runtime was gone before we began
    channels = Channels.shared(task.memory, memory_fd, task.size)
    os.close(memory_fd)
    code = 0
    try:
        shell = Shell(task, channels, lifeline, bell_fd)
        signal.signal(signal.SIGTERM, shell.end)
        shell.run()
    except BaseException:  # noqa: BLE001 - the process ends with it; whoever looks for the bug needs to see where it was
        traceback.print_exc()
        code = 1
    os._exit(code)  # at once: no library's threads or destructors may hold up the end


def _receive(lifeline: socket.socket) -> Task | None:
    with lifeline.makefile("rb", buffering=0) as stream:
        head = stream.read(4)
        if len(head) < 4:
            return None
        (length,) = struct.unpack("<I", head)
        body = b""
        while len(body) < length:
            part = stream.read(length - len(body))
            if not part:
                return None
            body += part
    task = pickle.loads(body)
    assert isinstance(task, Task)
    return task
