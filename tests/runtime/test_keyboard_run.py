"""A person at a terminal: his keys and the progress bar share it, and he gets it back as it was, however the run ends."""

import json
import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest

COMMAND = "from runtime.cli import main; main()"
CHANGES = ("robot.operator={driver: keyboard}", "supervisor.give_up_after_s=0.6")


class Terminal:
    """A pseudo-terminal with a run in it."""

    def __init__(self, *arguments: str) -> None:
        self.master, self.slave = pty.openpty()
        self.before = termios.tcgetattr(self.slave)
        changes = [word for change in CHANGES for word in ("--set", change)]
        command = [sys.executable, "-c", COMMAND, "run", "static_corridor", "--no-log", *changes, *arguments]
        environment = os.environ | {"TERM": "xterm", "COLUMNS": "100"}
        self.run = subprocess.Popen(command, stdin=self.slave, stdout=self.slave, stderr=self.slave, env=environment)
        self.shown = b""

    def read(self) -> bool:
        ready = select.select([self.master], [], [], 0.1)[0]
        if ready:
            self.shown += os.read(self.master, 65536)
        return bool(ready)

    def press(self, key: bytes, then: bytes) -> None:
        """Press a key until the bar shows what it leads to."""
        self.shown = b""
        os.write(self.master, key)
        deadline = time.monotonic() + 60
        while then not in self.shown:
            assert self.run.poll() is None, self.shown
            assert time.monotonic() < deadline, self.shown
            self.read()

    def end(self) -> int:
        while self.run.poll() is None:
            self.read()
        while self.read():
            pass
        assert termios.tcgetattr(self.slave) == self.before
        assert self.shown.rfind(b"\x1b[?25h") > self.shown.rfind(b"\x1b[?25l")  # the cursor is shown again
        os.close(self.master)
        os.close(self.slave)
        return self.run.returncode


@pytest.mark.parametrize(("by", "code", "outcome"), [("emergency stop", 1, "stopped"), ("Ctrl-C", 130, "interrupted")])
def test_keys_act_and_the_terminal_is_given_back(by: str, code: int, outcome: str, tmp_path: Path) -> None:
    terminal = Terminal("--json", str(tmp_path / "a.json"))
    terminal.press(b"", then=b"m  run ")
    terminal.press(b"p", then=b"stand_down ")
    terminal.press(b"w", then=b"m  run ")  # a jog moves it although it is paused
    terminal.press(b"p", then=b"0.4")
    terminal.press(b" ", then=b"latch ")
    terminal.press(b"r", then=b"m  run ")
    if by == "Ctrl-C":
        terminal.run.send_signal(signal.SIGINT)
    else:
        terminal.press(b" ", then=b"latch ")
    assert terminal.end() == code
    report = json.loads((tmp_path / "a.json").read_text())
    assert report["outcome"] == outcome
    assert "emergency_stop" in {fault["fault"] for fault in report["faults"]}
