"""Hands ticks from the loop to the thread that writes them; the loop never waits for it in real time."""

from __future__ import annotations

import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from runtime.cycle import Cycle
from runtime.log import rvl
from runtime.log.header import RunHeader
from runtime.log.settings import LogSettings
from runtime.log.writer import Writer

_CLOSE_TIMEOUT_S = 10.0


@dataclass(frozen=True, slots=True)
class RecorderReport:
    """How the recording went."""

    written_ticks: int = 0
    dropped_ticks: int = 0  # not recorded at all; the tick after says so in the log, which cannot be replayed across it
    dropped_views: int = 0  # recorded for replay, but not drawn
    bytes_written: int = 0
    queue_high_water: int = 0
    fault: str = ""  # why the log could no longer be written


class _Entry(NamedTuple):
    cycle: Cycle
    drawn: bool
    lost_before: int
    waiting: int  # ticks that were in the queue before it


class _Signal:
    """Wakes the one thread that waits for it; given twice before it is taken, it counts once.  A bare lock costs least."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._lock.acquire()

    def give(self) -> None:
        with suppress(RuntimeError):  # it was given already
            self._lock.release()

    def take(self, timeout_s: float) -> None:
        self._lock.acquire(timeout=timeout_s)


class Recorder:
    """Records cycles.  Without a path and a live view it does nothing.

    In real time a full queue costs first what is only drawn (from half full), then whole ticks, both counted.  In lockstep
    `record` waits for the writer instead, so that the log is complete and two runs of one seed have the same content.
    """

    def __init__(
        self, path: Path | None, settings: LogSettings, header: RunHeader, *, lockstep: bool, live: bool = False
    ) -> None:
        """Touch nothing yet."""
        self._path, self._settings, self._header = path, settings, header
        self._lockstep, self._live = lockstep, live
        self._capacity = settings.queue_ticks
        self._queue: deque[_Entry] = deque()  # appended to by the loop, popped from by the writer: each is atomic
        self._work = _Signal()
        self._room = _Signal()
        self._thread: threading.Thread | None = None
        self._writer: Writer | None = None
        self._closing = False
        self._due = 0  # ticks that the writer is woken for; known with the first tick's period
        self._lost = 0
        self._dropped_ticks = self._dropped_views = self._written_ticks = self._high_water = 0
        self._fault = ""

    def open(self) -> None:
        """Create the log; one that cannot be created is a fault, not an error.

        Raises:
            ConfigurationError: the port of the live view is taken.
        """
        if self._thread is not None or (self._path is None and not self._live):
            return
        rvl.warm_up()
        try:
            self._writer = Writer(self._path, self._settings, self._header, self._settings.live_port if self._live else None)
        except OSError as error:
            self._fault = f"the log {self._path} cannot be created: {error.strerror}"
            return
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def record(self, cycle: Cycle) -> None:
        """Hand over a tick."""
        if self._thread is None or self._closing or self._fault:
            self._dropped_ticks += self._path is not None
            return
        waiting = len(self._queue)
        if waiting >= self._capacity:
            waiting = self._await_room() if self._lockstep else waiting
            if waiting >= self._capacity:
                self._lost += 1
                self._dropped_ticks += 1
                return
        drawn = self._lockstep or 2 * waiting < self._capacity
        self._dropped_views += not drawn
        self._queue.append(_Entry(cycle, drawn, self._lost, waiting))
        self._lost = 0
        self._high_water = max(self._high_water, waiting + 1)
        if waiting + 1 >= (self._due or self._ticks_due(cycle)):
            self._work.give()

    def fault(self) -> str:
        """Return why the log can no longer be written; empty while it can."""
        return self._fault or (self._writer.fault if self._writer is not None else "")

    def close(self) -> RecorderReport:
        """Write what waits, finish the file and return how it went; again and again the same."""
        self._closing = True
        self._work.give()
        if self._thread is not None:
            self._thread.join(3 * _CLOSE_TIMEOUT_S)
        return RecorderReport(
            written_ticks=self._written_ticks,
            dropped_ticks=self._dropped_ticks,
            dropped_views=self._dropped_views,
            bytes_written=self._writer.bytes_written if self._writer is not None else 0,
            queue_high_water=self._high_water,
            fault=self.fault(),
        )

    def _await_room(self) -> int:
        """Wait for the writer and return how many ticks wait in the queue; still full: the log has failed."""
        self._work.give()
        while (waiting := len(self._queue)) >= self._capacity and not self._fault:
            self._room.take(self._settings.flush_interval_s)
        return waiting if not self._fault else self._capacity

    def _ticks_due(self, cycle: Cycle) -> int:
        """Return after how many ticks to wake the writer: right after a tick's work is the best time for it to run."""
        in_interval = int(self._settings.flush_interval_s * 1e9) // cycle.sensed.tick.period_ns
        most = min(self._settings.batch_ticks, self._capacity)
        self._due = most if self._lockstep else max(1, min(most, in_interval))
        return self._due

    def _run(self) -> None:
        """Write until closed; whatever goes wrong in here becomes the log's fault and never the loop's."""
        assert self._writer is not None
        try:
            while self._write_batch(self._writer):
                pass
            self._writer.send_drawn()
        except Exception as error:  # noqa: BLE001
            self._fail(f"the log {self._path} cannot be written: {error}")
        finally:
            self._writer.close(_CLOSE_TIMEOUT_S)

    def _write_batch(self, writer: Writer) -> bool:
        """Write what waits and flush it; return whether there may be more to come."""
        if not self._closing and len(self._queue) < (self._due or 1):
            self._work.take(self._settings.flush_interval_s)
        entries = [self._queue.popleft() for _ in range(min(len(self._queue), self._settings.batch_ticks))]
        self._room.give()
        for entry in entries:
            writer.put(entry.cycle, drawn=entry.drawn, lost_before=entry.lost_before, waiting=entry.waiting)
        writer.send()
        while not (flushed := writer.flush(self._settings.flush_interval_s)) and not self._closing:
            pass  # the disk is stalled: what comes meanwhile waits in our queue, which is bounded, and not in Rerun, which is not
        if writer.fault:
            self._fail(writer.fault)
            return not self._closing
        self._written_ticks += len(entries) if flushed else 0
        return bool(self._queue) or not self._closing

    def _fail(self, sentence: str) -> None:
        self._fault = self._fault or sentence
        self._dropped_ticks += len(self._queue)
        self._queue.clear()
        self._room.give()
