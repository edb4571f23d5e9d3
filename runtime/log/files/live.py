"""The live view: a Rerun server on loopback that viewers may watch, with a bound of ours in front of it.

A viewer that is stalled stalls Rerun's server until it gives that viewer up (some 20 s with 0.41); what is sent meanwhile would
wait in Rerun's batcher, which has no bound.  So a thread of its own hands over one round at a time and goes on when the server
has taken it; what comes meanwhile waits in a bounded queue, where the oldest makes room for the newest.
"""

from __future__ import annotations

import socket
import threading
from collections import deque
from collections.abc import Iterable
from contextlib import suppress
from typing import Literal, NamedTuple

import rerun as rr
import rerun.blueprint as rrb

from drivers.interface.errors import ConfigurationError
from runtime.log.exact.columns import ArrowColumn
from runtime.log.files.recording import new_recording

_SERVER_MEMORY = "64MiB"  # what a viewer that joins late still gets to see
_MOST_SENDS = 1000  # that wait: about 3 s of a run at 50 Hz, some 5 MB
_CLOSE_TIMEOUT_S = 2.0
_PATIENCE_S = 0.2  # between two looks whether the view is being closed


class _Send(NamedTuple):
    entity: str
    times: tuple[ArrowColumn, ...]
    columns: tuple[rr.ComponentColumn | ArrowColumn, ...]


class LiveView:
    """What viewers on this machine see; nobody who sends to it ever waits."""

    def __init__(self, port: int, blueprint: rrb.Blueprint) -> None:
        """Serve on loopback.

        Raises:
            ConfigurationError: the port is taken.
        """
        _require_free(port)
        self._stream = new_recording()
        server = rr.GrpcServerSink(bind_ip="127.0.0.1", port=port, server_memory_limit=_SERVER_MEMORY)
        self._stream.set_sinks(server, default_blueprint=blueprint)
        self._static: deque[tuple[str, tuple[rr.AsComponents, ...]]] = deque()  # few, and never dropped
        self._sends: deque[_Send] = deque(maxlen=_MOST_SENDS)
        self.dropped_sends = 0
        self._work = threading.Event()
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="live-view", daemon=True)
        self._thread.start()

    def log(self, entity: str, *parts: rr.AsComponents, static: Literal[True]) -> None:
        """Show what holds for the whole run."""
        self._static.append((entity, parts))
        self._work.set()

    def send_columns(
        self, entity: str, times: Iterable[ArrowColumn], columns: Iterable[rr.ComponentColumn | ArrowColumn]
    ) -> None:
        """Show a batch of columns; when too many wait, the oldest is dropped for it."""
        self.dropped_sends += len(self._sends) == _MOST_SENDS
        self._sends.append(_Send(entity, tuple(times), tuple(columns)))
        self._work.set()

    def close(self, timeout_s: float = _CLOSE_TIMEOUT_S) -> None:
        """Show what waits, and let the viewers go; a server that is stalled is left to itself."""
        self._closing = True
        self._work.set()
        self._thread.join(timeout_s)
        end = threading.Thread(target=self._stream.disconnect, name="live-view-end", daemon=True)
        end.start()
        end.join(timeout_s)

    def _run(self) -> None:
        while not self._closing or self._static or self._sends:
            self._work.wait()
            self._work.clear()
            while self._static:
                entity, parts = self._static.popleft()
                self._stream.log(entity, *parts, static=True)
            for _ in range(len(self._sends)):
                with suppress(IndexError):  # it made room meanwhile
                    self._stream.send_columns(*self._sends.popleft())
            if not self._taken():
                return

    def _taken(self) -> bool:
        """Wait until the server has taken everything; return whether it has before the view was closed."""
        while True:
            try:
                self._stream.flush(timeout_sec=_PATIENCE_S)
            except RuntimeError:  # a viewer is stalled
                if self._closing:
                    return False
            else:
                return True


def _require_free(port: int) -> None:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError as error:
            raise ConfigurationError(f"log.live_port {port} is taken; choose another with --set log.live_port=N") from error
