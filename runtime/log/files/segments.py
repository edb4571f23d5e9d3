"""One log in files of a bounded size: begins the next one in time, and deletes the oldest where the disk budget asks for it."""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from pathlib import Path

from runtime.cycle import Cycle
from runtime.keyframes import KeyFrame
from runtime.log.drawn.layout import layout
from runtime.log.files.finishing import Finishing
from runtime.log.files.live import LiveView
from runtime.log.files.marks import Segment
from runtime.log.files.paths import numbered
from runtime.log.files.stops import Stops
from runtime.log.header import RunHeader
from runtime.log.settings import LogSettings
from runtime.log.writer import Writer

_MB = 1_000_000
_CLOSE_TIMEOUT_S = 10.0
_LARGEST = 1.25  # times its size: so far a file waits for a key frame


@dataclass(slots=True)
class _File:
    """One file of the log, and the loop's time that it covers [ns]."""

    path: Path | None
    index: int
    first_ns: int = 0
    last_ns: int = 0
    bytes: int = 0
    deleted: bool = False


class Segments:
    """Writes ticks as a writer does, into one file after the other; each opens in the viewer by itself."""

    def __init__(self, path: Path | None, settings: LogSettings, header: RunHeader, live_port: int | None) -> None:
        """Begin the first file, which bears the log's own name until there is a second.

        Raises:
            OSError: the file cannot be created.
            ConfigurationError: the port of the live view is taken.
        """
        self._path, self._settings, self._header = path, settings, header
        self._live = LiveView(live_port, layout(header)) if live_port is not None else None
        self._recording_id = str(uuid.uuid4())
        self._files: list[_File] = []
        self._longest_sync_s = 0.0
        self._fault = ""
        self._finishing: Finishing | None = None  # the file before the present one
        self.stops = Stops()
        self._writer = self._begin(path)

    @property
    def fault(self) -> str:
        """Why the log can no longer be written; empty while it can."""
        return self._fault or (self._finishing.fault if self._finishing is not None else "") or self._writer.fault

    @property
    def files(self) -> tuple[Path, ...]:
        """All files that were not deleted."""
        return tuple(file.path for file in self._files if file.path is not None and not file.deleted)

    @property
    def deleted(self) -> tuple[int, ...]:
        """The indices of the files that were deleted."""
        return tuple(file.index for file in self._files if file.deleted)

    @property
    def bytes_written(self) -> int:
        """Size of all files together, also of those deleted since."""
        return sum(file.bytes for file in self._files[:-1]) + self._writer.bytes_written

    @property
    def longest_sync_s(self) -> float:
        """For how long something that was written waited at most until it was on the disk."""
        return max(self._longest_sync_s, self._writer.longest_sync_s)

    def put(self, cycle: Cycle, *, drawn: bool, lost_before: int, waiting: int = 0, key_frame: KeyFrame | None = None) -> None:
        """Add a tick to the batch; see `Writer.put`.

        Raises:
            OSError: the next file cannot be begun.
        """
        if self._path is not None and self._is_due(key_frame):
            self._rotate(self._path)
        now_ns = cycle.sensed.tick.start_ns
        file = self._files[-1]
        file.first_ns, file.last_ns = file.first_ns or now_ns, now_ns
        self.stops.put(cycle)
        self._writer.put(cycle, drawn=drawn, lost_before=lost_before, waiting=waiting, key_frame=key_frame)

    def send(self) -> None:
        """Send the batch and start a new one."""
        self._writer.send()

    def flush(self, timeout_s: float) -> bool:
        """Push what was sent out to the file; return whether that was done in time."""
        return self._writer.flush(timeout_s)

    def close(self, timeout_s: float, *, complete: bool) -> None:
        """Finish the last file; only a log that is `complete` gets the mark that says so."""
        self._await_finished()
        self._writer.close(timeout_s, last=True if complete else None)
        if self._live is not None:
            self._live.close()

    def _begin(self, path: Path | None) -> Writer:
        segment = Segment(self._recording_id, len(self._files), self.deleted)
        writer = Writer(path, self._settings, self._header, self._live, segment)
        self._files.append(_File(path, segment.index))
        return writer

    def _is_due(self, key_frame: KeyFrame | None) -> bool:
        """Return whether the file has its size: the next one is to begin with a key frame, if that does not take too long."""
        full = self._writer.bytes_written / (self._settings.segment_mb * _MB)
        return not self.fault and full >= (1.0 if key_frame is not None else _LARGEST)

    def _rotate(self, path: Path) -> None:
        self._await_finished()
        self._writer.send()
        self._writer.send_drawn()
        self._writer.flush(self._settings.flush_interval_s)  # nothing newer may be in the next file before this is in its own
        file, full = self._files[-1], self._writer
        file.bytes = full.bytes_written
        if file.index == 0:
            file.path = path.rename(numbered(path, 0))
        surplus = self._surplus()
        self._writer = self._begin(numbered(path, file.index + 1))
        self._finishing = Finishing(full, surplus, _CLOSE_TIMEOUT_S)

    def _await_finished(self) -> None:
        if self._finishing is None:
            return
        self._files[-2].bytes, longest_sync_s = self._finishing.result()
        self._longest_sync_s = max(self._longest_sync_s, longest_sync_s)
        self._fault, self._finishing = self.fault, None

    def _surplus(self) -> list[Path]:
        """Return the oldest files, to be deleted until there is room for another one, but none around a stop."""
        surplus: list[Path] = []
        if self._settings.disk_budget_mb is None:
            return surplus
        room = (self._settings.disk_budget_mb - self._settings.segment_mb) * _MB
        kept = [file for file in self._files if not file.deleted]
        excess = sum(file.bytes for file in kept) - room
        for file in kept:
            if excess > 0 and file.path is not None and not self.stops.any_near(file.first_ns, file.last_ns):
                surplus.append(file.path)
                file.deleted, excess = True, excess - file.bytes
        return surplus
