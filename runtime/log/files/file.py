"""The file of a log: one thread fills it from a pipe and sums it up, another one keeps it on the disk.

What was written survives the process, and what was forced onto the disk survives the machine; the first must not wait for the
second, which takes as long as the disk likes.
"""

from __future__ import annotations

import errno
import fcntl
import os
import select
import struct
import termios
import threading
import time
import zlib
from collections.abc import Callable
from pathlib import Path

PIPE_BYTES = 1 << 20
_POLL_S = 0.001


class LogFile:
    """A file that is written at once, and forced onto the disk every `sync_interval_s`, by its own threads.

    An error is kept as a sentence, and the pipe drained all the same.
    """

    def __init__(self, path: Path, sync_interval_s: float) -> None:
        """Create the file.

        Raises:
            OSError: it cannot be created.
        """
        self._path = path
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o644)
        self._source, self._inlet = os.pipe()
        fcntl.fcntl(self._inlet, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
        self._idle = threading.Event()
        self._idle.set()
        self._sync_pause_s = sync_interval_s / 2  # so that what came just after one is still in time with the next
        self._unsynced_s: float | None = None  # since when something waits to be forced onto the disk
        self._ended = threading.Event()
        self.fault = ""
        self.bytes_written = 0
        self.crc32 = 0  # of all bytes written
        self.longest_sync_s = 0.0  # that something waited until it was on the disk
        self._threads = [
            threading.Thread(target=self._pump, name="log-file", daemon=True),
            threading.Thread(target=self._keep_synced, name="log-sync", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    @property
    def inlet(self) -> str:
        """The path under which the pipe can be opened for writing."""
        return f"/proc/self/fd/{self._inlet}"

    def release_inlet(self) -> None:
        """Let go of our own end, so that the pipe ends when the other writer closes it."""
        os.close(self._inlet)

    def settle(self, timeout_s: float) -> bool:
        """Wait until all that lies in the pipe is in the file; return whether that was done in time."""
        deadline_s = time.monotonic() + timeout_s
        while _waiting(self._source) or not self._idle.is_set():
            if time.monotonic() > deadline_s:
                return False
            time.sleep(_POLL_S)
        return True

    def finish(self, timeout_s: float) -> bool:
        """Wait until everything is on the disk and close the file; return whether that was done in time."""
        deadline_s = time.monotonic() + timeout_s
        for thread in self._threads:
            thread.join(max(0.0, deadline_s - time.monotonic()))
            if thread.is_alive():
                return False
        os.close(self._source)
        os.close(self._file)
        return True

    def abandon(self) -> None:
        """Give up a file whose disk is stalled: from here on the pipe runs empty, so that Rerun can end."""
        self.fault = self.fault or f"the log {self._path} is incomplete: its disk is stalled"
        threading.Thread(target=self._drain, name="log-drain", daemon=True).start()

    def _drain(self) -> None:
        while os.read(self._source, PIPE_BYTES):
            pass

    def _pump(self) -> None:
        while chunk := self._next():
            self._try(self._write, chunk)
            if not _waiting(self._source):
                self._idle.set()
        self._ended.set()

    def _next(self) -> bytes:
        select.select([self._source], [], [])
        self._idle.clear()  # before the pipe is emptied: whoever waits for both must not find both in between
        return os.read(self._source, PIPE_BYTES)

    def _keep_synced(self) -> None:
        while not self._ended.wait(self._sync_pause_s):
            self._try(self._sync)
        self._try(self._sync)

    def _try(self, step: Callable[..., None], *chunk: bytes) -> None:
        if self.fault:
            return
        try:
            step(*chunk)
        except OSError as error:
            self.fault = f"the log {self._path} cannot be written: {error.strerror}"

    def _write(self, chunk: bytes) -> None:
        begun_s, rest = time.monotonic(), memoryview(chunk)
        while rest:
            written = os.write(self._file, rest)
            self.bytes_written += written
            self.crc32 = zlib.crc32(rest[:written], self.crc32)
            rest = rest[written:]
            self._unsynced_s = self._unsynced_s or begun_s  # only now: a sync that has begun already may not cover it

    def _sync(self) -> None:
        since_s, self._unsynced_s = self._unsynced_s, None
        if since_s is None:
            return
        try:
            os.fdatasync(self._file)
        except OSError as error:
            if error.errno != errno.EINVAL:  # a device or a pipe, which has nothing to sync
                raise
        self.longest_sync_s = max(self.longest_sync_s, time.monotonic() - since_s)


def _waiting(pipe: int) -> bool:
    """Return whether anything lies in a pipe."""
    count: int = struct.unpack("i", fcntl.ioctl(pipe, termios.FIONREAD, b"\0\0\0\0"))[0]
    return count > 0
