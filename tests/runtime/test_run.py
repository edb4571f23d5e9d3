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
from runtime.log import read
from runtime.report import RunReport


def drive(name: str, *changes: str, seed: int = 0, **options: object) -> RunReport:
    result = run.run(configuration.load(name, changes), run.RunOptions(seed=seed, **options))
    assert result.failure is None
    return result.report


def but_for_times(report: RunReport) -> RunReport:
    recording = report.recording and replace(report.recording, path="", bytes=0, bytes_per_s=0.0, queue_high_water=0)
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
        plan = assembly.planner.plan

        def broken(belief: Belief, route: Route) -> Plan:
            return self.breaking(belief.tick) or plan(belief, route)

        assembly.planner.plan = broken

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
