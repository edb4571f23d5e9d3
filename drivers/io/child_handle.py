"""A running child: its process, and the lifeline, a socket whose end it takes for the end of the runtime."""

from __future__ import annotations

import pickle
import select
import signal
import socket
import struct
import subprocess
import sys
import threading

from drivers.io.child import LAST_WORDS_S, Task

_PROGRAM = "import sys; sys.path[:] = sys.argv[4:]; from drivers.io.child import main; main(*map(int, sys.argv[1:4]))"


class ChildHandle:
    """Starts the child, and ends it."""

    def __init__(self, task: Task, memory: int, bell: int) -> None:
        """Start it with the descriptors of memory and bell.  A fresh interpreter: nothing of the runtime is copied into it.

        Raises:
            OSError: the system refused.
        """
        self._lifeline, theirs = socket.socketpair()
        try:
            inherited = (theirs.fileno(), memory, bell)
            self._process = subprocess.Popen(
                [sys.executable, "-c", _PROGRAM, *map(str, inherited), *sys.path],
                stdin=subprocess.DEVNULL,
                pass_fds=inherited,
                process_group=0,  # Ctrl-C in the terminal is for the runtime alone
            )
            body = pickle.dumps(task)
            self._lifeline.sendall(struct.pack("<I", len(body)) + body)
        except BaseException:
            self._lifeline.close()
            raise
        finally:
            theirs.close()

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    def ended(self, seconds: float, closing: threading.Event) -> bool:
        """Wait at most so long; return whether it has ended by itself."""
        if closing.is_set():
            return False
        select.select((self._lifeline,), (), (), seconds)  # readable: its end of the socket is closed
        return self._process.poll() is not None

    def reason(self) -> str:
        """Return how it ended, as a sentence."""
        code = self._process.poll()
        if code is not None and code < 0:
            return f"its process was killed by {signal.Signals(-code).name}"
        return f"its process ended with code {code}"

    def end(self, patience_s: float = LAST_WORDS_S + 0.5) -> None:
        """Close the lifeline, wait for the rest and the close, and kill what does not end."""
        self._lifeline.close()
        try:
            self._process.wait(patience_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
