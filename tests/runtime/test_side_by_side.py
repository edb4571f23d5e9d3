"""Work in processes of its own ends with the process that asked for it."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
from pathlib import Path

WAIT_S = 60.0

ASKS = """
import os, signal, sys
from runtime.evaluations.side_by_side import Workers, side_by_side


def work(pipe: str) -> str:
    held = os.open(pipe, os.O_WRONLY)  # what reads the pipe meets its end when nobody holds it any more
    os.write(held, b"w")
    signal.pause()
    return ""


if __name__ == "__main__":
    side_by_side(tuple(sys.argv[1:]), work, Workers(jobs=2))
"""


def _read_end(pipe: Path) -> int:
    os.mkfifo(pipe)
    return os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)


def _next(end: int) -> bytes:
    """Return a byte from a pipe, or none where nobody holds its other end any more."""
    poll = select.poll()
    poll.register(end, select.POLLIN)
    assert poll.poll(WAIT_S * 1e3), "nothing happened"
    return os.read(end, 1)


def test_workers_of_a_killed_evaluation_end_with_it(tmp_path: Path) -> None:
    """Two workers hold a named pipe each; both pipes end once the parent is killed."""
    script, pipes = tmp_path / "asks.py", [tmp_path / "one", tmp_path / "two"]
    script.write_text(ASKS)
    ends = [_read_end(pipe) for pipe in pipes]
    parent = subprocess.Popen([sys.executable, str(script), *map(str, pipes)])
    assert [_next(end) for end in ends] == [b"w", b"w"]
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    assert [_next(end) for end in ends] == [b"", b""]
