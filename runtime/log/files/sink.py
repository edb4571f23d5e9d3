"""Where the log goes: Rerun encodes it into a pipe, and we write what comes out of the pipe to the file.

Rerun's own file sink is not used for the file: when a disk fills up its thread dies, flushing and disconnecting can then
block for ever, and the process cannot even exit (seen with 0.41).  A pipe never fails; the file is ours, and so are its errors.

The file has no footer: Rerun collects it in memory for as long as the run lasts (0.5 MB a second of ours), every reader does
without, and a log whose writer was killed looks no different.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun.chunk import Chunk

from runtime.log.exact.columns import ArrowColumn
from runtime.log.files.file import LogFile
from runtime.log.files.live import LiveView
from runtime.log.files.recording import new_recording


class Sink:
    """Where columns go: into a log file, a live view, or both."""

    def __init__(
        self,
        path: Path | None,
        live: LiveView | None,
        blueprint: rrb.Blueprint,
        sync_interval_s: float,
        recording_id: str | None = None,
    ) -> None:
        """Create the file; files with the same `recording_id` are one recording to the viewer.

        Raises:
            OSError: the file cannot be created.
        """
        self._file = LogFile(path, sync_interval_s) if path is not None else None
        self._stream = new_recording(recording_id)
        if self._file is not None:
            self._stream.set_sinks(rr.FileSink(self._file.inlet, write_footer=False), default_blueprint=blueprint)
            self._file.release_inlet()
        to_file = () if self._file is None else (self._stream,)
        self._streams = to_file if live is None else (*to_file, live)

    @property
    def fault(self) -> str:
        """Why the file can no longer be written; empty while it can."""
        return self._file.fault if self._file is not None else ""

    @property
    def bytes_written(self) -> int:
        """Size of the file so far."""
        return self._file.bytes_written if self._file is not None else 0

    def log_static(self, entity: str, *parts: rr.AsComponents) -> None:
        """Log what holds for the whole run."""
        for stream in self._streams:
            stream.log(entity, *parts, static=True)

    def send(self, entity: str, index: Iterable[ArrowColumn], columns: Iterable[rr.ComponentColumn | ArrowColumn]) -> None:
        """Send a batch of columns."""
        times, values = tuple(index), tuple(columns)
        for stream in self._streams:
            stream.send_columns(entity, times, values)

    def forward(self, chunk: Chunk) -> None:
        """Send a piece of another log as it is."""
        for stream in self._streams:
            stream.send_chunks(chunk)

    @property
    def longest_sync_s(self) -> float:
        """For how long something that was written waited at most until it was on the disk."""
        return self._file.longest_sync_s if self._file is not None else 0.0

    def flush(self, timeout_s: float) -> bool:
        """Push everything sent so far out to the file; return whether that was done in time."""
        try:
            self._stream.flush(timeout_sec=timeout_s)
        except RuntimeError:  # the pipe is full: the disk is stalled
            return False
        return True

    def close(self, timeout_s: float, entity: str = "", seal: Callable[[int, int], rr.AsComponents] | None = None) -> None:
        """Finish the file; one that cannot be finished in time is given up, with a fault.

        `seal` is given size and CRC-32 of all that is in the file; what it returns is logged under `entity`, and last.
        """
        file = self._file
        if file is not None and not (self.flush(timeout_s) and file.settle(timeout_s)):
            file.abandon()
        elif file is not None and seal is not None:
            self._stream.log(entity, seal(file.bytes_written, file.crc32), static=True)
        self._stream.disconnect()
        if file is not None and not file.finish(timeout_s):
            file.abandon()
