"""A run over a real driver and a real wire replays to the bit, with the emulation gone: replay opens no wire."""

import socket
from pathlib import Path

import pytest

from runtime.cli import run_command
from tests.faults.emulated import PATIENCE_S, emulated
from tests.faults.test_emulated_run import GOAL


def test_a_run_of_emulated_devices_replays_without_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "a.rrd"
    with emulated() as robot, robot.run("--set", GOAL, "--duration", "4", "--log", str(log)) as run:
        said, _ = run.communicate(timeout=2 * PATIENCE_S)
    assert log.is_file(), said

    def no_socket(*_: object, **__: object) -> None:
        raise AssertionError("replay opened a wire")

    monkeypatch.setattr(socket, "socket", no_socket)
    code = run_command(["replay", str(log)])
    out = capsys.readouterr().out
    assert code == 0, out
    assert out.startswith("identical: ")
    assert int(out.split()[1]) > 20
