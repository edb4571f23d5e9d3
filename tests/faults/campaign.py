"""The fault campaign: `python -m tests.faults.campaign [NAME ...]` runs the scripts here and prints who answered what, how soon.

A script (`*.yaml`) names a configuration and its cases, each one misbehaviour of one device.  Without `robot` the devices are
simulated and misbehave by `robot.faults`, in lockstep; with one they are emulated and the firmware misbehaves.
`answer` is the most severe response from the fault on; what latches ends the run, for nobody resets here, and whatever does not
must reach its goal all the same.
Exit code 1: another answer or another end, an exception that escaped, or a recording that lost something.
"""

import argparse
import faulthandler
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

import yaml
from rich.console import Console
from rich.table import Table

from drivers.emulated_truth import EmulatedTruth
from drivers.interface.commands import Command
from drivers.interface.settings import Settings
from runtime import configuration
from runtime.cycle import Cycle
from runtime.faults import Fault, Response
from runtime.log.files.paths import files_of
from runtime.log.reading.read import ticks
from runtime.run import RunOptions, RunResult, run
from tests.faults.emulated import EmulatedRobot, emulated

HERE = Path(__file__).parent
HANGS_S = 300.0  # a case that takes longer ends the campaign with a traceback
OUR_OWN = {"loop", "planner"}  # a machine that is too slow is no device's fault, and the dead man trips by nothing else
TOO_SLOW = 0.02  # of the deadlines missed
AT_REST = 1e-3  # m/s or rad/s


class Script(Settings):
    """One file."""

    configuration: str
    robot: str | None = None  # the emulated one, beside the script or shipped
    wires: tuple[str, ...] = EmulatedRobot.wires
    changes: tuple[str, ...] = ()
    at_s: float
    for_s: float
    cases: tuple[dict[str, Any], ...]


@dataclass
class Watch:
    """What the supervisor did, from its own cycles."""

    at_s: float
    end_s: float
    began_ns: int | None = None
    answer: Response = Response.RUN
    faults: list[str] = field(default_factory=list)  # in the order in which they came up
    answered_s: float | None = None  # from the fault to the first command to stop
    zero_s: float | None = None  # from the fault to the first zero command
    resumed: bool = False

    def take(self, cycle: Cycle) -> None:
        start_ns, verdict = cycle.sensed.tick.start_ns, cycle.verdict
        self.began_ns = start_ns if self.began_ns is None else self.began_ns
        since_s = (start_ns - self.began_ns) * 1e-9 - self.at_s
        if since_s < 0.0:
            return
        seen = [fault for fault in verdict.faults if fault.device not in OUR_OWN and fault.fault is not Fault.DEAD_MAN_TRIPPED]
        self.answer = max([self.answer, *(fault.response for fault in seen)])
        self.faults += [fault.fault.value for fault in seen if fault.fault.value not in self.faults]
        if since_s > self.end_s - self.at_s and verdict.response is Response.RUN:
            self.resumed = True
        if self.answered_s is None and verdict.response >= Response.STAND_DOWN:
            self.answered_s = since_s
        if self.zero_s is None and self.answered_s is not None and _stands(verdict.command):
            self.zero_s = since_s


def _stands(command: Command) -> bool:
    """Whether base and arm are both told to rest."""
    twist, arm = command.base, command.arm
    base_rests = twist is None or max(abs(twist.vx), abs(twist.vy), abs(twist.wz)) < AT_REST
    return base_rests and (arm is None or arm.is_rest)


@dataclass(frozen=True)
class Finding:
    """A row of the table."""

    script: str
    case: str
    watch: Watch
    outcome: str
    wrong: str


def scripts() -> dict[str, Script]:
    return {
        path.stem: Script(**yaml.safe_load(path.read_text()))
        for path in sorted(HERE.glob("*.yaml"))
        if "cases:" in path.read_text()
    }


def findings(name: str, script: Script, log: Path) -> Iterator[Finding]:
    """Run every case of a script."""
    for case in script.cases:
        told = {key: value for key, value in case.items() if key != "answer"}
        faulthandler.dump_traceback_later(HANGS_S, exit=True)
        try:
            watch, result = (simulated if script.robot is None else over_a_wire)(script, dict(told), log)
        finally:
            faulthandler.cancel_dump_traceback_later()
        wrong = _wrong(case["answer"].split(), watch, result, log)
        for file in files_of(log):
            file.unlink()
        yield Finding(name, _words(told), watch, result.report.outcome, wrong)


def simulated(script: Script, case: dict[str, Any], log: Path) -> tuple[Watch, RunResult]:
    """Run a case in lockstep."""
    case = {"at_s": script.at_s, "for_s": script.for_s} | case
    watch = Watch(case["at_s"], case["at_s"] + case["for_s"])
    changes = (*script.changes, f"robot.faults={yaml.safe_dump([case], default_flow_style=True, width=1000).strip()}")
    return watch, run(configuration.load(script.configuration, changes), RunOptions(log=log, progress=watch.take))


def over_a_wire(script: Script, case: dict[str, Any], log: Path) -> tuple[Watch, RunResult]:
    """Run a case against `trundle emulate`; the script goes by the time since the truth was opened."""
    at_s, for_s = case.pop("at_s", script.at_s), case.pop("for_s", script.for_s)
    device, watch = case.pop("device"), Watch(at_s, at_s + for_s)
    fault = yaml.safe_dump([{"from_s": at_s, "until_s": at_s + for_s} | case], default_flow_style=True, width=1000).strip()
    name = str(HERE / script.robot) if str(script.robot).endswith(".yaml") else str(script.robot)
    kept = {"robot": name, "wires": script.wires, "scenario": script.configuration}
    with emulated(f"robot.emulation.{device}.faults={fault}", **kept) as robot:
        loaded = configuration.load(script.configuration, (*robot.overrides, *script.changes))
        with _begin_noted(lambda now_ns: setattr(watch, "began_ns", now_ns)):
            return watch, run(loaded, RunOptions(log=log, progress=watch.take))


@contextmanager
def _begin_noted(note: Callable[[int], None]) -> Iterator[None]:
    opening = EmulatedTruth.open

    def open_and_note(truth: EmulatedTruth) -> None:
        opening(truth)
        note(time.monotonic_ns())

    with patch.object(EmulatedTruth, "open", open_and_note):
        yield


def _wrong(answers: list[str], watch: Watch, result: RunResult, log: Path) -> str:
    given = watch.answer.name.lower()
    wrong = [] if given in answers else [f"{' or '.join(answers)} was expected"]
    outcome = "stopped" if given == "latch" else "reached"
    if result.report.outcome != outcome:
        wrong.append(f"it should have {outcome}" if outcome == "reached" else "it should have been stopped")
    if result.failure is not None:
        wrong.append(f"{type(result.failure).__name__}: {result.failure}")
    recording = result.report.recording
    if recording is None or recording.fault or recording.dropped_ticks or len(ticks(log)) != result.report.ticks:
        wrong.append("the recording is not whole")
    if given in {"stand_down", "latch"} and watch.zero_s is None:
        wrong.append("zero was never sent")
    if wrong and result.report.missed_deadlines > TOO_SLOW * result.report.ticks:
        wrong.append(f"but the machine was too slow: {result.report.missed_deadlines} deadlines of {result.report.ticks} missed")
    return "; ".join(wrong)


def _words(case: dict[str, Any]) -> str:
    return " ".join(str(case[key]) if key in {"device", "kind"} else f"{key}={case[key]}" for key in case)


def table_of(found: list[Finding]) -> Table:
    table = Table("script", "fault", "response", "seen as", "answered s", "zero s", "resumed", "outcome", "verdict")
    for each in found:
        watch = each.watch
        times = (f"{seconds:.2f}" if seconds is not None else "-" for seconds in (watch.answered_s, watch.zero_s))
        seen = ", ".join(watch.faults) or "-"
        resumed = "-" if watch.answered_s is None else "yes" if watch.resumed else "no"
        table.add_row(
            each.script, each.case, watch.answer.name.lower(), seen, *times, resumed, each.outcome, each.wrong or "well"
        )
    return table


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="of scripts; none: all")
    names = parser.parse_args().names
    found: list[Finding] = []
    with tempfile.TemporaryDirectory() as folder:
        for name, script in scripts().items():
            if not names or name in names:
                for finding in findings(name, script, Path(folder) / "case.rrd"):
                    found.append(finding)
                    print(f"{finding.script}: {finding.case}: {finding.wrong or 'well'}", file=sys.stderr, flush=True)
    Console(width=200).print(table_of(found))
    return int(any(finding.wrong for finding in found))


if __name__ == "__main__":
    sys.exit(main())
