"""Where the log goes: Rerun encodes it into a pipe, and we write what comes out of the pipe to the file.

Rerun's own file sink is not used for the file: when a disk fills up its thread dies, flushing and disconnecting can then
block for ever, and the process cannot even exit (seen with 0.41).  A pipe never fails; the file is ours, and so are its errors.

The file has no footer: Rerun collects it in memory for as long as the run lasts (0.5 MB a second of ours), every reader does
without, and a log whose writer was killed looks no different.
"""

from __future__ import annotations

import fcntl
import os
import threading
from collections.abc import Iterable
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from runtime.log.columns import ArrowColumn
from runtime.log.live import LiveView
from runtime.log.recording import new_recording

_PIPE_BYTES = 1 << 20


class LogFile:
    """A file that a thread of its own fills from a pipe; an error is kept as a sentence, and the pipe drained all the same."""

    def __init__(self, path: Path) -> None:
        """Create the file.

        Raises:
            OSError: it cannot be created.
        """
        self._path = path
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o644)
        self._source, self._inlet = os.pipe()
        fcntl.fcntl(self._inlet, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
        self.fault = ""
        self.bytes_written = 0
        self._thread = threading.Thread(target=self._pump, name="log-file", daemon=True)
        self._thread.start()

    @property
    def inlet(self) -> str:
        """The path under which the pipe can be opened for writing."""
        return f"/proc/self/fd/{self._inlet}"

    def release_inlet(self) -> None:
        """Let go of our own end, so that the pipe ends when the other writer closes it."""
        os.close(self._inlet)

    def finish(self, timeout_s: float) -> bool:
        """Wait until everything is in the file and close it; return whether that was done in time."""
        self._thread.join(timeout_s)
        if self._thread.is_alive():
            return False
        os.close(self._source)
        os.close(self._file)
        return True

    def abandon(self) -> None:
        """Give up a file whose disk is stalled: from here on the pipe runs empty, so that Rerun can end."""
        self.fault = self.fault or f"the log {self._path} is incomplete: its disk is stalled"
        threading.Thread(target=self._pump, name="log-drain", daemon=True).start()

    def _pump(self) -> None:
        while chunk := os.read(self._source, _PIPE_BYTES):
            if self.fault:
                continue
            try:
                self._write(chunk)
            except OSError as error:
                self.fault = f"the log {self._path} cannot be written: {error.strerror}"

    def _write(self, chunk: bytes) -> None:
        rest = memoryview(chunk)
        while rest:
            written = os.write(self._file, rest)
            self.bytes_written += written
            rest = rest[written:]


class Sink:
    """A Rerun stream into a log file, a live view, or both."""

    def __init__(self, path: Path | None, live_port: int | None, blueprint: rrb.Blueprint) -> None:
        """Open everything.

        Raises:
            OSError: the file cannot be created.
            ConfigurationError: the port of the live view is taken.
        """
        self._stream = new_recording()
        self._live = LiveView(live_port, blueprint) if live_port is not None else None
        self._file = LogFile(path) if path is not None else None
        if self._file is not None:
            self._stream.set_sinks(rr.FileSink(self._file.inlet, write_footer=False), default_blueprint=blueprint)
            self._file.release_inlet()

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
        if self._file is not None:
            self._stream.log(entity, *parts, static=True)
        if self._live is not None:
            self._live.log(entity, *parts, static=True)

    def send(self, entity: str, index: Iterable[ArrowColumn], columns: Iterable[rr.ComponentColumn | ArrowColumn]) -> None:
        """Send a batch of columns."""
        times, values = tuple(index), tuple(columns)
        if self._file is not None:
            self._stream.send_columns(entity, times, values)
        if self._live is not None:
            self._live.send_columns(entity, times, values)

    def flush(self, timeout_s: float) -> bool:
        """Push everything sent so far out to the file; return whether that was done in time."""
        try:
            self._stream.flush(timeout_sec=timeout_s)
        except RuntimeError:  # the pipe is full: the disk is stalled
            return False
        return True

    def close(self, timeout_s: float) -> None:
        """Finish the file; one that cannot be finished in time is given up, with a fault."""
        if self._live is not None:
            self._live.close()
        if self._file is not None and not self.flush(timeout_s):
            self._file.abandon()
        self._stream.disconnect()
        if self._file is not None and not self._file.finish(timeout_s):
            self._file.abandon()
