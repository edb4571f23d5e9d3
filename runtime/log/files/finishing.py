"""Finishes a file of a log in a thread of its own, which takes as long as the disk likes; the next file is written meanwhile."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path

from runtime.log.writer import Writer


class Finishing:
    """A file that gets no more ticks, and older ones for which there is no room any more."""

    def __init__(self, writer: Writer, surplus: Sequence[Path], timeout_s: float) -> None:
        """Close the writer, delete the surplus."""
        self._writer, self._surplus, self._timeout_s = writer, surplus, timeout_s
        self._fault = ""
        self._thread = threading.Thread(target=self._run, name="log-finish", daemon=True)
        self._thread.start()

    @property
    def fault(self) -> str:
        """What went wrong so far."""
        return self._fault or self._writer.fault

    def result(self) -> tuple[int, float]:
        """Wait for the end; return the size of the file, and its longest sync [s]."""
        self._thread.join()
        return self._writer.bytes_written, self._writer.longest_sync_s

    def _run(self) -> None:
        try:
            self._writer.close(self._timeout_s, last=False)
            for path in self._surplus:
                path.unlink(missing_ok=True)
        except Exception as error:  # noqa: BLE001 - it is the log's fault, whatever it is, and nobody else's
            self._fault = f"a file of the log cannot be finished: {error}"
