"""The doctor: what it finds of simulated devices, of devices that are not there, and of the machine."""

import json
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from drivers.interface.clock import SimClock
from drivers.interface.devices import DeviceHealth, DeviceState
from drivers.interface.samples import Stamp, WheelSample
from runtime import configuration
from runtime.cli import run_command
from runtime.doctor.doctor import examine
from runtime.doctor.findings import Examination, Finding, Verdict, examination_path, recent_examination
from runtime.doctor.machine import examine_machine
from runtime.doctor.motion import examine_motion
from runtime.doctor.stream import examine_stream
from runtime.sections import RealtimeSection, SupervisorSection

MS = 1_000_000


def verdicts(findings: list[Finding] | tuple[Finding, ...], subject: str) -> dict[str, Verdict]:
    return {finding.check: finding.verdict for finding in findings if finding.subject == subject}


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_a_simulated_robot_is_fit(tmp_path):
    examination = examine(configuration.load("static_corridor"), permitted=lambda _: False)
    assert examination.motion_allowed
    assert set(verdicts(examination.findings, "base").values()) == {Verdict.GOOD}
    assert set(verdicts(examination.findings, "base")) == {"present", "rate", "jitter", "clock", "first command", "watchdog"}
    assert set(verdicts(examination.findings, "camera")) == {"present", "rate", "jitter", "clock"}


def test_what_is_missing_is_said_and_forbids_motion(tmp_path, capsys):
    changes = ["--set", "robot.truth={driver: emulated_truth, port: 47912, open_timeout_s: 0.2}"]
    assert run_command(["doctor", "static_corridor", *changes, "--json", "told.json"]) == 3
    told = json.loads(Path("told.json").read_text())
    assert told["motion_allowed"] is False
    (missing,) = [finding for finding in told["findings"] if finding["verdict"] == "forbids"]
    assert (missing["subject"], missing["check"]) == ("truth", "present")
    assert "no emulation answers at 127.0.0.1:47912" in missing["told"]
    assert "motion is NOT allowed" in capsys.readouterr().out


def test_the_next_run_finds_it_for_an_hour():
    assert recent_examination("nobody", 0.0) == ""
    path = examination_path("somebody")
    path.parent.mkdir()
    path.write_text(Examination("somebody", "x.yaml", "2026-01-01T00:00:00+00:00", ()).as_json())
    made_s = os.stat(path).st_mtime
    assert json.loads(recent_examination("somebody", made_s + 3599.0))["motion_allowed"] is True
    assert recent_examination("somebody", made_s + 3601.0) == ""


def stamps(times_ms: list[float], age_ms: float = 4.0) -> list[Stamp]:
    return [Stamp(round(t * MS), round((t + age_ms) * MS), i) for i, t in enumerate(times_ms)]


EVERY_10_MS = [10.0 * i for i in range(200)]


@pytest.mark.parametrize(
    ("seen", "check", "verdict"),
    [
        (stamps(EVERY_10_MS), "rate", Verdict.GOOD),
        (stamps(EVERY_10_MS), "jitter", Verdict.GOOD),
        (stamps(EVERY_10_MS), "clock", Verdict.GOOD),
        (stamps(EVERY_10_MS[::2]), "rate", Verdict.FORBIDS),
        (stamps([12.5 * i for i in range(160)]), "rate", Verdict.WARNING),
        (stamps(EVERY_10_MS[:100] + EVERY_10_MS[110:]), "jitter", Verdict.WARNING),
        (stamps(EVERY_10_MS, age_ms=500.0), "clock", Verdict.FORBIDS),
        (stamps(EVERY_10_MS, age_ms=-5.0), "clock", Verdict.WARNING),
        (stamps([0.0] * 200), "rate", Verdict.FORBIDS),  # the same sample again and again
        ([], "rate", Verdict.FORBIDS),
    ],
)
def test_what_a_stream_says(seen, check, verdict):
    health = DeviceHealth("base", DeviceState.OPEN, expected_period_ns=10 * MS)
    assert verdicts(examine_stream(health, seen, 2.0, SupervisorSection()), "base")[check] is verdict


@dataclass
class Wheels:
    """A base on a virtual clock that arms as told by the test."""

    clock: SimClock
    jump_rad: float = 0.0
    dead_man_s: float | None = 0.1
    watchdog_s: float | None = 0.3
    clears: bool = True
    kinematics: None = None
    real_time: bool = True
    commanded_ns: int = field(default=1 << 62)
    cleared: bool = False

    def command(self, twist, expires_ns):
        self.commanded_ns = self.clock.now_ns()

    def drain(self):
        now_ns = self.clock.now_ns()
        turned = np.full(3, self.jump_rad if self.commanded_ns < now_ns else 0.0)
        return (WheelSample(Stamp(now_ns, now_ns, 0), turned, np.zeros(3)),)

    def clear_faults(self):
        self.cleared = self.clears

    def health(self):
        silent_s = (self.clock.now_ns() - self.commanded_ns) * 1e-9
        tripped = self.watchdog_s is not None and silent_s > self.watchdog_s and not self.cleared
        acted = self.dead_man_s is not None and silent_s > self.dead_man_s
        state = DeviceState.FAULTED if tripped else DeviceState.OPEN
        return DeviceHealth("base", state, "its watchdog expired" * tripped, expired_commands=int(acted))


@pytest.mark.parametrize(
    ("base", "jump", "watchdog"),
    [
        ({}, Verdict.GOOD, Verdict.GOOD),
        ({"watchdog_s": None}, Verdict.GOOD, Verdict.WARNING),  # nothing behind the driver's own dead man
        ({"watchdog_s": None, "dead_man_s": None}, Verdict.GOOD, Verdict.FORBIDS),
        ({"clears": False}, Verdict.GOOD, Verdict.FORBIDS),
    ],
)
def test_who_stops_it_when_commands_cease(base, jump, watchdog):
    clock = SimClock()
    found = verdicts(examine_motion("base", Wheels(clock, **base), clock, real_time=True), "base")
    assert (found["first command"], found["watchdog"]) == (jump, watchdog)


def test_a_base_that_jumps_at_the_first_command_is_found_out():
    clock = SimClock()
    base = Wheels(clock, jump_rad=0.2)
    found = examine_motion("base", base, clock, real_time=True)
    assert found[0].verdict is Verdict.FORBIDS


def test_the_machine_under_another_root(tmp_path):
    folder = tmp_path / "sys/devices/system/cpu"
    for cpu, governor in enumerate(("performance", "powersave")):
        (folder / f"cpu{cpu}/cpufreq").mkdir(parents=True)
        (folder / f"cpu{cpu}/cpufreq/scaling_governor").write_text(f"{governor}\n")
    (tmp_path / "proc/device-tree").mkdir(parents=True)
    (tmp_path / "proc/device-tree/model").write_text("NVIDIA Jetson Orin Nano\0")
    found = verdicts(examine_machine(tmp_path, RealtimeSection(), tmp_path), "machine")
    assert found["CPU governor"] is Verdict.WARNING
    assert found["Jetson power mode"] is Verdict.WARNING  # nvpmodel is not here to be asked
    (folder / "cpu1/cpufreq/scaling_governor").write_text("performance\n")
    (tmp_path / "proc/device-tree/model").write_text("Raspberry Pi\0")
    found = verdicts(examine_machine(tmp_path, RealtimeSection(), tmp_path), "machine")
    assert found["CPU governor"] is Verdict.GOOD
    assert "Jetson power mode" not in found
    assert {"disk space", "write speed", "SCHED_FIFO", "mlockall", "trundle", "libraries"} <= set(found)
