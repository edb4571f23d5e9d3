"""Ctrl-C and SIGTERM: the robot is stopped, the recording is complete, the exit code says so."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from runtime.log import read

COMMAND = "import sys; from runtime.cli import run_command; sys.exit(run_command(sys.argv[1:]))"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_ends_in_order(number: signal.Signals, tmp_path: Path) -> None:
    log, report = tmp_path / "a.rrd", tmp_path / "a.json"
    arguments = ["run", "static_corridor", "--realtime", "--log", str(log), "--json", str(report)]
    with subprocess.Popen([sys.executable, "-c", COMMAND, *arguments], stdout=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 60
        while not (log.exists() and log.stat().st_size > 50_000):  # it is under way when its recording grows
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.05)
        process.send_signal(number)
        assert process.wait(30) == 130
    told = json.loads(report.read_text())
    assert told["outcome"] == "interrupted"
    assert told["recording"]["ticks"] == told["ticks"]
    assert len(read.ticks(log)) == told["ticks"]
