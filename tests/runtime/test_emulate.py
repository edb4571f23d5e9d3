"""The free run on a virtual clock, and the configuration of an emulation."""

from pathlib import Path

import pytest

from drivers.interface.errors import ConfigurationError
from runtime import configuration
from runtime.assembly import assemble
from runtime.cli import run_command
from runtime.emulate import CATCH_UP_NS, FreeRun, build
from sim_drivers.scenarios.square import Square, SquareSettings
from sim_drivers.world import MujocoWorld, WorldSettings

ROBOT = "robot: {name: ghost, radius_m: 0.1, height_m: 0.3, truth: {driver: emulated_truth}, operator: {driver: script}%s}"
STEP_NS = 2_000_000


class VirtualClock:
    """Sleeps at once; what each sleep lasts beyond its deadline is given."""

    def __init__(self) -> None:
        self.time_ns = 1_000_000_000
        self.late_ns = 0

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = max(self.time_ns, deadline_ns) + self.late_ns
        self.late_ns = 0


@pytest.fixture
def run() -> tuple[MujocoWorld, VirtualClock, FreeRun]:
    world, clock = MujocoWorld(Square(SquareSettings()).draw(0), WorldSettings(physics_step_s=0.002)), VirtualClock()
    free = FreeRun(world, clock)
    world.compile()
    clock.time_ns += 5_000_000_000  # compiling took a while
    free.start()
    return world, clock, free


def test_the_world_keeps_to_the_grid_of_its_steps(run):
    world, clock, free = run
    began_ns = clock.time_ns
    for _ in range(50):
        free.step()
        assert free.now_ns == clock.time_ns
    assert world.now_ns == clock.time_ns - began_ns == 50 * STEP_NS
    assert free.late_ns == 0


def test_a_hiccup_is_caught_up_and_shifts_nothing(run):
    world, clock, free = run
    began_ns = clock.time_ns
    clock.late_ns = CATCH_UP_NS - STEP_NS - 700_000
    free.step()
    assert (clock.time_ns - began_ns) - world.now_ns < STEP_NS
    free.step()
    assert free.late_ns == 0
    assert world.now_ns == clock.time_ns - began_ns


def test_what_cannot_be_caught_up_is_counted_and_the_clocks_stay_together(run):
    world, clock, free = run
    began_ns = clock.time_ns
    clock.late_ns = 500_000_000  # suspended
    free.step()
    assert world.now_ns == STEP_NS
    assert free.late_ns == 500_000_000
    assert free.now_ns == clock.time_ns
    free.step()
    assert world.now_ns + free.late_ns == clock.time_ns - began_ns


def written(folder: Path, emulation: str, more: str = "world: {scenario: square}") -> str:
    path = folder / "ghost.yaml"
    path.write_text(f"{ROBOT % emulation}\n{more}\nmission: {{goals: [], time_limit_s: 1}}\nplanner: {{name: idle}}\n")
    return str(path)


def test_every_device_whose_driver_has_firmware_is_emulated(tmp_path):
    loaded = configuration.load(written(tmp_path, ", emulation: {truth: {silent_after_s: 5}}"))
    ((name, firmware),) = loaded.emulation
    assert (name, firmware.name, firmware.settings.silent_after_s) == ("truth", "emulated_truth", 5.0)
    assert configuration.load(written(tmp_path, ", emulation: {}")).emulation[0][1].settings.silent_after_s == 3.0
    assert configuration.load(written(tmp_path, "")).emulation is None


def test_the_effective_configuration_holds_it(tmp_path):
    first = configuration.load(written(tmp_path, ", emulation: {truth: {silent_after_s: 5}}"))
    again = tmp_path / "again.yaml"
    again.write_text(first.as_yaml())
    assert configuration.load(str(again)).emulation == first.emulation


@pytest.mark.parametrize(
    ("emulation", "more", "told"),
    [
        (", emulation: {base: {}}", "world: {scenario: square}", "robot.emulation.base is no device of this robot"),
        (", emulation: {truth: {silent: 1}}", "world: {scenario: square}", "unknown key 'robot.emulation.truth.silent'"),
        ("", "world: {scenario: square}", "robot.emulation names no device"),
        (", emulation: {}", "", "an emulation needs world.scenario"),
    ],
)
def test_what_cannot_be_emulated_is_told(emulation, more, told, tmp_path):
    with pytest.raises(ConfigurationError, match=told):
        build(configuration.load(written(tmp_path, emulation, more)), 0)


def test_a_simulated_device_has_no_place_in_an_emulated_robot(tmp_path, capsys):
    path = written(tmp_path, ", emulation: {}, base: {driver: sim_omni}")
    assert run_command(["run", path, "--no-log"]) == 2
    assert "no robot.emulation" in capsys.readouterr().err.replace("\n", " ")


def test_an_emulation_ends_after_its_duration(tmp_path, capsys):
    path = written(tmp_path, ", emulation: {}")
    assert run_command(["emulate", path, "--duration", "0.2", "--set", "robot.truth.port=47911"]) == 0
    told = capsys.readouterr().out
    assert "truth (emulated_truth): UDP 127.0.0.1:47911" in told
    assert "ready: square" in told


def test_a_watchdog_that_would_act_before_a_command_has_expired_is_refused(tmp_path):
    path = tmp_path / "hasty.yaml"
    base = "base: {driver: omni_can, watchdog_s: 0.2, bus: {interface: virtual}}"
    path.write_text(f"robot: {{name: hasty, radius_m: 0.1, height_m: 0.3, {base}}}\nmission: {{goals: [], time_limit_s: 1}}\n")
    with pytest.raises(ConfigurationError, match=r"hasty.yaml: robot.base.watchdog_s of 0.2 s is no longer than a command lives"):
        assemble(configuration.load(str(path)), 0)
    assemble(configuration.load(str(path), ("supervisor.command_lifetime_s=0.1",)), 0)
