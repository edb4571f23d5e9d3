"""Hands ticks from the loop to the thread that writes them; the loop never waits for it in real time."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from runtime.cycle import Cycle
from runtime.keyframes import KeyFrame
from runtime.log.exact.part import warm_up
from runtime.log.files.segments import Segments
from runtime.log.header import RunHeader
from runtime.log.reading.incidents import bundle
from runtime.log.settings import LogSettings

_CLOSE_TIMEOUT_S = 10.0
_COLLECTING = 0.4  # of the flush interval; the rest is for encoding and writing, also where the processor is busy
_POLL_S = 0.001


@dataclass(frozen=True, slots=True)
class RecorderReport:
    """How the recording went."""

    written_ticks: int = 0
    dropped_ticks: int = 0  # not recorded at all; the tick after says so in the log, which cannot be replayed across it
    dropped_views: int = 0  # recorded for replay, but not drawn
    bytes_written: int = 0
    queue_high_water: int = 0
    files: tuple[Path, ...] = ()  # of the log, but for those that were deleted
    deleted_files: int = 0  # the disk budget had no room for them
    longest_sync_s: float = field(default=0.0, compare=False)  # that something written waited until it was on the disk
    incidents: tuple[Path, ...] = ()  # recordings made of latched stops
    fault: str = ""  # why the log could no longer be written


class _Entry(NamedTuple):
    cycle: Cycle
    drawn: bool
    lost_before: int
    waiting: int  # ticks that were in the queue before it
    key_frame: KeyFrame | None


class _Signal:
    """Wakes the one thread that waits for it; given twice before it is taken, it counts once.  A bare lock costs least."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._lock.acquire()

    def give(self) -> None:
        with suppress(RuntimeError):  # it was given already
            self._lock.release()

    def take(self, timeout_s: float) -> bool:
        return self._lock.acquire(timeout=timeout_s)


class Recorder:
    """Records cycles.  Without a path and a live view it does nothing.

    In real time a full queue costs first what is only drawn (from half full), then whole ticks, both counted.  In lockstep
    `record` waits for the writer instead, so that the log is complete and two runs of one seed have the same content.
    """

    def __init__(
        self, path: Path | None, settings: LogSettings, header: Callable[[], RunHeader], *, lockstep: bool, live: bool = False
    ) -> None:
        """Touch nothing yet; `header` is asked for when the log is opened."""
        self._path, self._settings, self._header = path, settings, header
        self._lockstep, self._live = lockstep, live
        self._capacity = settings.queue_ticks
        self._queue: deque[_Entry] = deque()  # appended to by the loop, popped from by the writer: each is atomic
        self._work = _Signal()
        self._room = _Signal()
        self._thread: threading.Thread | None = None
        self._segments: Segments | None = None
        self._closing = False
        self._due = 0  # ticks that the writer is woken for; known with the first tick's period
        self._lost = 0
        self._dropped_ticks = self._dropped_views = self._written_ticks = self._high_water = 0
        self._fault = ""
        self._period_s = 0.0
        self._incidents: tuple[Path, ...] | None = None

    def open(self) -> None:
        """Create the log; one that cannot be created is a fault, not an error.

        Raises:
            ConfigurationError: the port of the live view is taken.
        """
        if self._thread is not None or (self._path is None and not self._live):
            return
        warm_up()
        try:
            port = self._settings.live_port if self._live else None
            self._segments = Segments(self._path, self._settings, self._header(), port)
        except OSError as error:
            self._fault = f"the log {self._path} cannot be created: {error.strerror}"
            return
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def record(self, cycle: Cycle, key_frame: KeyFrame | None = None) -> None:
        """Hand over a tick, and what it was begun with if that is to be recorded."""
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
        self._queue.append(_Entry(cycle, drawn, self._lost, waiting, key_frame))
        self._lost = 0
        self._high_water = max(self._high_water, waiting + 1)
        if waiting + 1 >= (self._due or self._ticks_due(cycle)) and self._lockstep:
            self._work.give()  # in real time the writer looks by itself: to wake it may cost the loop as much as its whole tick

    def fault(self) -> str:
        """Return why the log can no longer be written; empty while it can."""
        return self._fault

    def close(self) -> RecorderReport:
        """Write what waits, finish the file and return how it went; again and again the same."""
        self._closing = True
        self._work.give()
        if self._thread is not None:
            self._thread.join(3 * _CLOSE_TIMEOUT_S)
        segments = self._segments
        if segments is None:
            return RecorderReport(dropped_ticks=self._dropped_ticks, fault=self._fault)
        self._fault = self._fault or segments.fault
        if self._incidents is None:
            self._incidents = self._bundled(segments)
        return RecorderReport(
            written_ticks=self._written_ticks,
            dropped_ticks=self._dropped_ticks,
            dropped_views=self._dropped_views,
            bytes_written=segments.bytes_written,
            queue_high_water=self._high_water,
            files=segments.files,
            deleted_files=len(segments.deleted),
            longest_sync_s=segments.longest_sync_s,
            incidents=self._incidents,
            fault=self._fault,
        )

    def _bundled(self, segments: Segments) -> tuple[Path, ...]:
        """Make a recording of each latched stop; what goes wrong with that is the log's fault, too."""
        if self._path is None or self._fault or not self._settings.incidents:
            return ()
        try:
            return bundle(self._path, segments.stops.latched_ticks)
        except Exception as error:  # noqa: BLE001 - the run's own report must be made
            self._fault = f"the recordings of the stops cannot be made: {error}"
            return ()

    def _await_room(self) -> int:
        """Wait for the writer and return how many ticks wait in the queue; still full: the log has failed."""
        self._work.give()
        while (waiting := len(self._queue)) >= self._capacity and not self._fault:
            self._room.take(self._settings.flush_interval_s)
        return waiting if not self._fault else self._capacity

    def _ticks_due(self, cycle: Cycle) -> int:
        """Return how many ticks make a batch: in real time so many that the oldest is in the file within the interval."""
        most = min(self._settings.batch_ticks, self._capacity)
        self._period_s = cycle.sensed.tick.period_ns * 1e-9
        in_time = 1 + int(_COLLECTING * self._settings.flush_interval_s / self._period_s)
        self._due = most if self._lockstep else min(most, in_time)
        return self._due

    def _run(self) -> None:
        """Write until closed; whatever goes wrong in here becomes the log's fault and never the loop's."""
        assert self._segments is not None
        try:
            while self._write_batch(self._segments):
                pass
        except Exception as error:  # noqa: BLE001
            self._fail(f"the log {self._path} cannot be written: {error}")
        finally:
            self._segments.close(_CLOSE_TIMEOUT_S, complete=not self._fault)
            self._fault = self._fault or self._segments.fault

    def _write_batch(self, segments: Segments) -> bool:
        """Write what waits and flush it; return whether there may be more to come."""
        self._await_work()
        entries = [self._queue.popleft() for _ in range(min(len(self._queue), self._settings.batch_ticks))]
        self._room.give()
        for entry in entries:
            cycle, drawn, lost_before, waiting, key_frame = entry
            segments.put(cycle, drawn=drawn, lost_before=lost_before, waiting=waiting, key_frame=key_frame)
        segments.send()
        while not (flushed := segments.flush(self._settings.flush_interval_s)) and not self._closing:
            pass  # the disk is stalled: what comes meanwhile waits in our queue, which is bounded, and not in Rerun, which is not
        if segments.fault:
            self._fail(segments.fault)
            return not self._closing
        self._written_ticks += len(entries) if flushed else 0
        return bool(self._queue) or not self._closing

    def _await_work(self) -> None:
        """Return when a batch is due, or the interval over.

        In lockstep the loop says so.  In real time the writer looks for itself, from when the last tick of a batch can be
        there: just after a tick's work the loop sleeps, and the interpreter is free.
        """
        begun_s = time.monotonic()
        while (missing := (self._due or 1) - len(self._queue)) > 0 and not self._closing:
            left_s = begun_s + self._settings.flush_interval_s - time.monotonic()
            pause_s = left_s if self._lockstep else max(_POLL_S, self._period_s * (missing - 1 if missing > 1 else 0.1))
            if left_s <= 0.0 or self._work.take(min(pause_s, left_s)):
                return

    def _fail(self, sentence: str) -> None:
        self._fault = self._fault or sentence
        self._dropped_ticks += len(self._queue)
        self._queue.clear()
        self._room.give()
