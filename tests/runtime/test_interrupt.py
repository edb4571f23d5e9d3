"""Ctrl-C and SIGTERM: the robot is stopped, the recording is complete, the exit code says so."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from runtime.interrupt import Interrupts, Phase, interruptible
from runtime.log.reading import read

COMMAND = "from runtime.cli import main; main()"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_ends_in_order(number: signal.Signals, tmp_path: Path) -> None:
    log, report = tmp_path / "a.rrd", tmp_path / "a.json"
    arguments = ["run", "static_corridor", "--realtime", "--log", str(log), "--json", str(report)]
    with subprocess.Popen([sys.executable, "-c", COMMAND, *arguments], stdout=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 60
        while not (log.exists() and log.stat().st_size > 400_000):  # more than what is written before the first tick
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.05)
        process.send_signal(number)
        assert process.wait(30) == 130
    told = json.loads(report.read_text())
    assert told["outcome"] == "interrupted"
    assert told["recording"]["ticks"] == told["ticks"]
    assert len(read.ticks(log)) == told["ticks"]


def test_what_a_signal_does_depends_on_how_far_the_run_has_come() -> None:
    interrupts = Interrupts()
    with pytest.raises(KeyboardInterrupt):
        interrupts.on_signal(signal.SIGINT, None)
    interrupts = Interrupts()
    interrupts.phase = Phase.DRIVING
    interrupts.on_signal(signal.SIGINT, None)
    assert interrupts.asked
    with pytest.raises(KeyboardInterrupt):
        interrupts.on_signal(signal.SIGTERM, None)
    interrupts.phase = Phase.CLOSING
    interrupts.on_signal(signal.SIGINT, None)


def test_the_handlers_of_before_are_put_back() -> None:
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    with interruptible():
        assert signal.getsignal(signal.SIGINT) != before[0]
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before
