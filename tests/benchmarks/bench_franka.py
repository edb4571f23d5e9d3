"""How the arm's 1 kHz exchange keeps up while the loop plans, camera and all."""

import os
import subprocess
import sys
from dataclasses import dataclass

from drivers.franka.driver import ExchangeFigures
from runtime import configuration
from runtime.assembly import Assembly
from runtime.run import RunOptions, run
from tests.benchmarks.figure import Figure
from tests.faults.emulated import ROOT
from tests.ports import free_port
from tests.sim_drivers.firmware.fcibench import free_host

ROUNDS = 3
COMMAND = "from runtime.cli import main; main()"


def figures() -> list[Figure]:
    """Run the way-point mission against an emulated arm."""
    return _exchange()


@dataclass
class _Watched:
    """The exchange's figures as of the last tick."""

    assembly: Assembly | None = None
    exchange: ExchangeFigures | None = None

    def ready(self, assembly: Assembly) -> None:
        self.assembly = assembly

    def look(self, _: object) -> None:
        assert self.assembly is not None
        self.exchange = self.assembly.robot.devices.arm.exchange


def _exchange() -> list[Figure]:
    told = (
        "robot=franka_emulated", f"robot.arm.host={free_host()}", f"robot.truth.port={free_port()}",
        f"robot.camera.memory=bench-{free_port()}",
        f"planner.rounds={ROUNDS}", "mission.time_limit_s=60", "robot.truth.open_timeout_s=30",
    )  # fmt: skip
    words = [word for change in (*told, "loop.system.priority=50") for word in ("--set", change)]
    command = [sys.executable, "-c", COMMAND, "emulate", "arm_waypoints", *words]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as world:
        try:
            while not world.stdout.readline().startswith("ready"):
                assert world.poll() is None
            watched = _Watched()
            load = os.getloadavg()[0]
            result = run(configuration.load("arm_waypoints", told), RunOptions(progress=watched.look, ready=watched.ready))
            assert result.report.outcome == "reached", result.report
            kept = watched.exchange
            print(f"# FCI exchange: {kept}, load average {load:.1f}")
            return [Figure("fci_cycles_lost", 100.0 * (1.0 - kept.kept), unit="%")]
        finally:
            world.terminate()
