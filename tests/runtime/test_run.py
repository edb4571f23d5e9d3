"""Whole runs, in lockstep: they end as they should, twice alike, and whatever breaks stops the robot and is written down."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.interface.commands import BodyTwist
from estimators.belief import Belief
from planners.planner import Plan
from planners.router import Route
from runtime import configuration, run
from runtime.assembly import Assembly
from runtime.cycle import Cycle
from runtime.faults import Response
from runtime.log.reading import read
from runtime.report import RunReport


def drive(name: str, *changes: str, seed: int = 0, **options: object) -> RunReport:
    result = run.run(configuration.load(name, changes), run.RunOptions(seed=seed, **options))
    assert result.failure is None
    return result.report


def but_for_times(report: RunReport) -> RunReport:
    recording = report.recording and replace(
        report.recording, path="", bytes=0, bytes_per_s=0.0, queue_high_water=0, longest_sync_s=0.0
    )
    return replace(report, stage_ms={}, realtime_factor=0.0, recording=recording)


def test_the_omni_robot_crosses_the_dynamic_hallway_and_twice_alike(tmp_path: Path) -> None:
    first = drive("dynamic_hallway", seed=3, log=tmp_path / "a.rrd")
    second = drive("dynamic_hallway", seed=3, log=tmp_path / "b.rrd")
    assert first.outcome == "reached"
    assert first.min_clearance_m > 0.0
    assert first.recording.ticks == first.ticks
    assert first.recording.dropped_ticks == 0
    assert but_for_times(first) == but_for_times(second)
    assert read.same_content(tmp_path / "a.rrd", tmp_path / "b.rrd") == ""
    other = drive("dynamic_hallway", "mission.time_limit_s=2", seed=4, log=tmp_path / "c.rrd")
    assert other.outcome == "timed_out"
    assert read.same_content(tmp_path / "a.rrd", tmp_path / "c.rrd") != ""


def test_the_skid_steer_base_drives_with_the_dynamic_window() -> None:
    report = drive("static_corridor", "robot=jackal", "mission.goals=[{x_m: 5.0, y_m: 0.0}]")
    assert report.outcome == "reached"
    assert report.odometry_error_m < 0.5


def test_the_roller_base_drives_too() -> None:
    report = drive("static_corridor", "robot.base.wheels=rollers", "mission.goals=[{x_m: 2.5, y_m: 0.3}]")
    assert report.outcome == "reached"


class Watcher:
    """Looks at every cycle, and breaks the planner from a tick on."""

    def __init__(self, breaking: Callable[[int], Plan | None] = lambda tick: None) -> None:
        self.breaking = breaking
        self.cycles: list[Cycle] = []

    def ready(self, assembly: Assembly) -> None:
        plan = assembly.parts.planner.plan

        def broken(belief: Belief, route: Route) -> Plan:
            return self.breaking(belief.tick) or plan(belief, route)

        assembly.parts.planner.plan = broken

    def update(self, cycle: Cycle) -> None:
        self.cycles.append(cycle)


def from_40_to_60(answer: Callable[[], Plan]) -> Callable[[int], Plan | None]:
    return lambda tick: answer() if 40 <= tick < 60 else None


def raising() -> Plan:
    raise ZeroDivisionError("division by zero")


def not_a_number() -> Plan:
    return Plan(base=BodyTwist(math.nan, 0.0, 0.0))


@pytest.mark.parametrize(("breaking", "fault"), [(raising, "planner_raised"), (not_a_number, "non_finite_command")])
def test_a_broken_planner_stops_the_robot_and_the_loop_goes_on(breaking: Callable[[], Plan], fault: str, tmp_path: Path) -> None:
    watcher = Watcher(from_40_to_60(breaking))
    changes = ("mission.goals=[{x_m: 3.5, y_m: 0.0}]",)
    report = drive("static_corridor", *changes, ready=watcher.ready, progress=watcher.update, log=tmp_path / "a.rrd")
    assert report.outcome == "reached"
    assert [(count.fault, count.ticks, count.first_tick) for count in report.faults if count.fault == fault] == [(fault, 20, 40)]
    broken = [cycle for cycle in watcher.cycles if 40 <= cycle.sensed.tick.index < 60]
    assert all(cycle.verdict.response is Response.STAND_DOWN for cycle in broken)
    assert broken[-1].verdict.command.base == BodyTwist()
    assert broken[-1].belief.twist.speed_m_s < 0.02
    assert fault in read.texts(tmp_path / "a.rrd")


def test_a_planner_that_takes_too_long_stops_the_robot() -> None:
    report = drive("static_corridor", "loop.work_ms=70", "loop.plan_ms=65", "mission.time_limit_s=3")
    faults = {count.fault for count in report.faults}
    assert {"planner_over_budget", "deadline_tolerated"} <= faults
    assert report.missed_deadlines > 20
    assert report.path_length_m < 0.05


def test_the_last_hop_stops_the_base_when_the_loop_hangs() -> None:
    watcher = Watcher()
    report = drive("static_corridor", "mission.time_limit_s=4", progress=watcher.update)
    assert report.outcome == "timed_out"
    assembled: list[Assembly] = []

    def hang(assembly: Assembly) -> None:
        assembled.append(assembly)

    drive("static_corridor", "mission.time_limit_s=2", ready=hang)
    world = assembled[0].world
    world.step_to(world.now_ns + 1_500_000_000)
    assert abs(world.data.body("base").cvel[3]) < 0.02


def test_a_collision_ends_the_run() -> None:
    report = drive("static_corridor", "planner.name=idle", "mission.start={x_m: 0.5, y_m: 0.0}", "mission.time_limit_s=1")
    assert report.outcome == "timed_out"
    blind = Watcher(lambda tick: Plan(base=BodyTwist(0.0, 0.5, 0.0)))
    report = drive("static_corridor", "shield.name=none", ready=blind.ready)
    assert report.outcome == "collided"
    assert report.min_clearance_m <= 0.005
    assert run.exit_code(run.RunResult(report)) == 1


class Unplugged:
    """Breaks one method of one device from a tick on."""

    def __init__(self, device: str, method: str) -> None:
        self.device, self.method = device, method
        self.tick = 0

    def ready(self, assembly: Assembly) -> None:
        device = getattr(assembly.robot.devices, self.device)
        working = getattr(device, self.method)

        def broken(*arguments: object) -> object:
            if self.tick >= 40:
                raise OSError("no such device")
            return working(*arguments)

        setattr(device, self.method, broken)

    def update(self, cycle: Cycle) -> None:
        self.tick = cycle.sensed.tick.index
        self.last = cycle


@pytest.mark.parametrize(("device", "method"), [("camera", "latest"), ("base", "drain"), ("base", "command")])
def test_a_device_that_dies_stops_the_robot_and_ends_the_run_in_order(device: str, method: str, tmp_path: Path) -> None:
    dying = Unplugged(device, method)
    configured = configuration.load("static_corridor")
    options = run.RunOptions(ready=dying.ready, progress=dying.update, log=tmp_path / "a.rrd")
    result = run.run(configured, options)
    assert result.report.outcome == "stopped"
    assert run.exit_code(result) == 3
    (fault,) = [count for count in result.report.faults if count.fault == "device_fault"]
    assert (fault.device, fault.detail) == (device, "OSError: no such device")
    assert 40 <= fault.first_tick <= 42
    assert dying.last.sensed.truth.twist.speed_m_s < 0.02
    assert len(read.ticks(tmp_path / "a.rrd")) == result.report.ticks
    assert "device_fault" in read.texts(tmp_path / "a.rrd")


def test_a_robot_that_cannot_be_stopped_is_told_and_the_report_is_made(tmp_path: Path) -> None:
    def ready(assembly: Assembly) -> None:
        def stop() -> None:
            raise OSError("no such device")

        assembly.robot.devices.camera.stop = stop

    options = run.RunOptions(ready=ready, log=tmp_path / "a.rrd")
    result = run.run(configuration.load("static_corridor", ("mission.time_limit_s=1",)), options)
    assert str(result.failure) == "the camera cannot stop: OSError: no such device"
    assert run.exit_code(result) == 3
    assert result.report.outcome == "timed_out"
    assert len(read.ticks(tmp_path / "a.rrd")) == result.report.ticks


@pytest.mark.parametrize(
    ("wish", "outcome", "fault"),
    [("continue", "timed_out", "log_unwritable"), ("stop", "stopped", "required_log_unwritable")],
)
def test_a_log_that_cannot_be_written_is_what_the_configuration_makes_of_it(wish: str, outcome: str, fault: str) -> None:
    changes = (f"log.on_unwritable={wish}", "mission.time_limit_s=4", "supervisor.give_up_after_s=1")
    report = drive("static_corridor", *changes, log=Path("/dev/full"))
    assert report.outcome == outcome
    (count,) = report.faults
    assert (count.fault, count.device) == (fault, "recorder")
    assert "No space left on device" in report.recording.fault


def test_an_estimator_that_fails_at_the_first_tick_ends_the_run_in_order(tmp_path: Path) -> None:
    def ready(assembly: Assembly) -> None:
        assembly.parts.estimator.update = lambda sensed: 1 / 0

    options = run.RunOptions(ready=ready, log=tmp_path / "a.rrd")
    result = run.run(configuration.load("static_corridor"), options)
    assert str(result.failure) == "the estimator failed at the first tick: ZeroDivisionError: division by zero"
    assert run.exit_code(result) == 1
    assert (result.report.outcome, result.report.ticks, result.report.error) == ("stopped", 0, str(result.failure))


def test_the_operators_script_pauses_and_sends_elsewhere() -> None:
    events = (
        "[{at_s: 0.0, action: enable}, {at_s: 1.0, action: pause}, {at_s: 2.0, action: resume},"
        " {at_s: 2.5, action: goal, x_m: 2.0, y_m: 0.0}]"
    )
    watcher = Watcher()
    report = drive("static_corridor", f"robot.operator.events={events}", progress=watcher.update)
    assert report.outcome == "reached"
    assert report.path_length_m < 2.5
    paused = [c for c in watcher.cycles if 1.6 < c.sensed.tick.start_ns * 1e-9 < 1.9]
    assert all(cycle.verdict.command.base == BodyTwist() for cycle in paused)


def test_an_emergency_stop_that_nobody_resets_ends_the_run() -> None:
    events = "[{at_s: 0.0, action: enable}, {at_s: 1.0, action: estop}]"
    report = drive("static_corridor", f"robot.operator.events={events}")
    assert report.outcome == "stopped"
    assert report.duration_s < 5.0
    assert "emergency_stop" in {count.fault for count in report.faults}
