"""A recorded run, run again: to the bit, from any key frame, by every planner; and what is changed is found and named."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivers.interface.errors import ConfigurationError
from planners.dwa.planner import DynamicWindow
from planners.planner import Plan
from runtime import configuration, registry, run
from runtime.cli import run_command
from runtime.log.exact.stream import rows
from runtime.registry import Part
from runtime.replay.replay import ReplayOptions, replay
from runtime.replay.stretches import Stretches
from tests.runtime.log_cycles import make_cycles
from tests.runtime.test_log_recorder import record as record_cycles

OF_AN_ARM = ("joint_waypoints",)


def record(path: Path, scenario: str, *changes: str, seconds: float = 2.0, **options: object) -> Path:
    settings = ("log.keyframe_interval_s=0.5", f"mission.time_limit_s={seconds}", *changes)
    result = run.run(configuration.load(scenario, settings), run.RunOptions(seed=3, log=path, **options))
    assert result.failure is None
    return path


@pytest.fixture(scope="module")
def hallway(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("logs") / "a.rrd", "dynamic_hallway", seconds=3.0)


@pytest.mark.parametrize("planner", [name for name in registry.names(Part.PLANNER) if name not in OF_AN_ARM])
def test_every_planner_comes_to_the_same(planner: str, tmp_path: Path) -> None:
    log = record(tmp_path / "a.rrd", "dynamic_hallway", f"planner={{name: {planner}}}", seconds=1.5)
    assert replay(log, ReplayOptions()).sentences() == ["identical: 31 ticks"]
    part = replay(log, ReplayOptions(first=25, last=28))
    assert part.identical
    assert 10 < part.beginnings[0] <= 25
    assert part.ticks == 29 - part.beginnings[0]


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        ("static_corridor", ("robot=jackal",)),
        ("door", ("estimator.memory.kind=layers", "estimator.tracks=grid", "estimator.odometry.kind=ekf")),
        ("door", ("estimator.odometry.kind=dead_reckoning",)),
        ("dynamic_hallway", ("planner.latency_ticks=2", "planner.period_ticks=3")),
        ("dynamic_hallway", ("estimator.registration.enabled=true", "estimator.tracks=truth")),
        ("arm_bench", ()),
        ("arm_bench_markers", ()),
        ("arm_waypoints", ()),
        ("static_corridor", ("loop.work_ms=70", "loop.plan_ms=65")),
        ("dynamic_hallway", ("loop.realtime=true", "planner.latency_ticks=1")),
    ],
)
def test_so_do_other_robots_estimators_and_late_loops(scenario: str, changes: tuple[str, ...], tmp_path: Path) -> None:
    log = record(tmp_path / "a.rrd", scenario, *changes)
    assert replay(log, ReplayOptions()).identical
    later = replay(log, ReplayOptions(first=25))
    assert later.identical
    assert later.beginnings[0] > 0


def test_a_changed_constant_is_found_at_the_first_tick_and_field(hallway: Path) -> None:
    report = replay(hallway, ReplayOptions(overrides=("planner.max_speed_m_s=0.2",)))
    assert report.exit_code == 1
    difference = report.first_difference
    assert difference is not None
    assert difference.field.startswith("plan.")
    row = next(row for row in rows(hallway) if row.tick == difference.tick)
    plan: Plan = row.decided("plan")
    assert str(plan.base.vx) in difference.recorded or "diagnostics" in difference.field or "path" in difference.field
    before = replay(hallway, ReplayOptions(overrides=("planner.max_speed_m_s=0.2",), last=max(0, difference.tick - 1)))
    assert before.identical or difference.tick == 0


def test_within_a_tolerance_each_tick_starts_from_its_recorded_belief(hallway: Path) -> None:
    report = replay(hallway, ReplayOptions(tolerance=1e-9))
    assert report.identical
    assert report.tolerance == 1e-9


def test_the_other_planner_is_recorded_beside_and_that_recording_replays(hallway: Path, tmp_path: Path) -> None:
    other, result = tmp_path / "b.rrd", tmp_path / "r.json"
    command = ["replay", str(hallway), "--planner", "point_ds", "--log", str(other), "--json", str(result), "--from", "40"]
    assert run_command(command) == 1
    said = json.loads(result.read_text())
    assert said["planner"] == "point_ds"
    assert said["beginnings"][0] > 0
    assert said["first_difference"]["field"].startswith("plan.")
    assert run_command(command) == 2  # it exists now
    assert run_command(["replay", str(hallway), "--log", str(hallway), "--force"]) == 2


def test_a_tick_that_is_missing_ends_a_stretch_and_the_next_key_frame_begins_one(hallway: Path) -> None:
    held = list(rows(hallway))
    keys = [row.tick for row in held if row.has_key_frame]
    stretches = Stretches([row for row in held if row.tick != 15], 0, None)
    spans = [[row.tick for row in stretch] for stretch in stretches]
    begins = min(tick for tick in keys if tick > 15)
    assert spans == [list(range(15)), list(range(begins, len(held)))]
    assert stretches.passed_over == begins - 16


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (ReplayOptions(overrides=("robot.radius_m=0.2",)), "a replay has the devices"),
        (ReplayOptions(planner="nobody"), "unknown planner 'nobody'"),
        (ReplayOptions(first=100_000), "--from 100000: the log .* holds ticks 0 to 60"),
        (ReplayOptions(last=61), "--to 61: the log .* holds ticks 0 to 60"),
        (ReplayOptions(first=40, last=20), "--to 20 is before --from 40"),
    ],
)
def test_what_cannot_be_replayed_is_refused_in_a_sentence(hallway: Path, options: ReplayOptions, said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        replay(hallway, options)


def test_a_part_that_cannot_say_its_state_costs_the_key_frames_and_not_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def raising(self: DynamicWindow) -> bytes:
        raise RuntimeError("no state")

    monkeypatch.setattr(DynamicWindow, "snapshot", raising)
    log = record(tmp_path / "a.rrd", "dynamic_hallway")
    assert not any(row.has_key_frame for row in rows(log))
    said = [report.detail for row in rows(log) for report in row.given]
    assert set(said) == {"no more key frames: the planner's snapshot raised RuntimeError: no state"}
    assert replay(log, ReplayOptions()).sentences() == ["identical: 41 ticks"]
    assert replay(log, ReplayOptions(first=30)).beginnings == (0,)


def test_a_log_of_an_older_schema_is_refused_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("runtime.log.writer.SCHEMA_VERSION", 1)
    record_cycles(tmp_path / "a.rrd", make_cycles(2))
    assert run_command(["replay", str(tmp_path / "a.rrd")]) == 2
    assert "has schema 1; this version of trundle reads" in " ".join(capsys.readouterr().err.split())


def test_no_log_an_empty_one_and_a_foreign_one_are_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.rrd").touch()
    (tmp_path / "text.rrd").write_text("no recording")
    for name in ("none.rrd", "empty.rrd", "text.rrd"):
        assert run_command(["replay", str(tmp_path / name)]) == 2
