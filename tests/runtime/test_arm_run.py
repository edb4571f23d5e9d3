"""An arm through the whole loop: alone beside its conveyor, and on top of a mobile base."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist, JointTrajectory
from estimators.belief import Belief
from planners.planner import Plan
from planners.router import Route
from runtime import configuration, run
from runtime.assembly import Assembly
from runtime.cycle import Cycle
from runtime.faults import Fault, Response
from runtime.log.reading import read
from runtime.report import RunReport
from sim_drivers.arm_model import READY_RAD, panda_joint

MS = 1_000_000
GOAL = np.array(READY_RAD) + np.array([0.5, 0.4, -0.5, 0.3, 0.6, -0.5, 0.8])
AFTER_S, MOVE_S = 0.2, 1.5  # the arm is asked to go from tick 4 on


def to_the_goal(belief: Belief) -> JointTrajectory | None:
    """The same trajectory again at every tick: it only lives longer."""
    if belief.stamp_ns < AFTER_S * 1e9:
        return None
    knots = np.stack((np.array(READY_RAD), GOAL))
    return JointTrajectory(round(AFTER_S * 1e9), np.array([0.0, MOVE_S]), knots, np.zeros_like(knots))


class Bench:
    """Runs with a planner of the test's own and keeps every cycle."""

    def __init__(self, ask: Callable[[Belief], JointTrajectory | None], base: BodyTwist | None = None) -> None:
        self.ask, self.base = ask, base
        self.also: Callable[[Cycle], None] = lambda cycle: None
        self.cycles: list[Cycle] = []
        self.assembly: Assembly | None = None

    def ready(self, assembly: Assembly) -> None:
        def plan(belief: Belief, route: Route) -> Plan:
            return Plan(base=self.base, arm=self.ask(belief))

        self.assembly, assembly.parts.planner.plan = assembly, plan

    def run(self, name: str, *changes: str, seconds: float) -> RunReport:
        settings = configuration.load(name, (*changes, f"mission.time_limit_s={seconds}"))
        result = run.run(settings, run.RunOptions(ready=self.ready, progress=self.keep))
        assert result.failure is None
        return result.report

    def keep(self, cycle: Cycle) -> None:
        self.cycles.append(cycle)
        self.also(cycle)

    def joints(self, at_s: float) -> np.ndarray:
        """Positions and velocities, (2, 7), as believed at a time."""
        joints = self.cycles[round(at_s * 20)].belief.joints
        return np.stack((joints.position_rad, joints.velocity_rad_s))

    def faults(self) -> set[Fault]:
        return {report.fault for cycle in self.cycles for report in cycle.verdict.faults} - {Fault.STARTING}


def test_an_arm_alone_watches_its_conveyor(tmp_path):
    settings = configuration.load("arm_bench", ("mission.time_limit_s=2",))
    cycles: list[Cycle] = []
    result = run.run(settings, run.RunOptions(log=tmp_path / "a.rrd", progress=cycles.append))
    assert result.failure is None
    assert result.report.outcome == "reached"
    assert not result.report.faults
    assert result.report.recording.ticks == result.report.ticks == 41
    first, last = (cycle.sensed.truth.obstacles for cycle in (cycles[1], cycles[-1]))
    assert [after.map_from_obstacle.y - before.map_from_obstacle.y for before, after in zip(first, last, strict=True)] == (
        pytest.approx([0.05 * 1.95] * 3, abs=2e-3)
    )
    logged = read.read(tmp_path / "a.rrd").at("/replay/sensed/joints", 40)
    joints = cycles[40].sensed.joints
    np.testing.assert_array_equal(logged["stamp.captured_ns"], [sample.stamp.captured_ns for sample in joints])
    np.testing.assert_array_equal(logged["position_rad"], np.concatenate([sample.position_rad for sample in joints]))


def test_a_renewed_trajectory_is_followed_to_its_end():
    bench = Bench(to_the_goal)
    bench.run("arm_bench", seconds=2.5)
    halfway, _ = bench.joints(AFTER_S + MOVE_S / 2)
    assert np.abs(halfway - (np.array(READY_RAD) + GOAL) / 2).max() < 0.03
    position, velocity = bench.joints(2.5)
    assert np.abs(position - GOAL).max() < 1e-3
    assert np.abs(velocity).max() < 0.01
    assert not bench.faults()


def test_what_a_slow_planner_asked_for_is_not_begun_anew_at_every_tick():
    bench = Bench(to_the_goal)
    bench.run("arm_bench", "planner.period_ticks=10", seconds=2.5)
    assert np.abs(bench.joints(2.5)[0] - GOAL).max() < 1e-3


def test_an_arm_decelerates_to_rest_when_the_loop_hangs():
    bench = Bench(to_the_goal)
    seen: list[tuple[np.ndarray, np.ndarray]] = []

    def look() -> None:
        arm = [bench.assembly.world.data.joint(panda_joint("arm", index)) for index in range(7)]
        seen.append((np.array([joint.qpos[0] for joint in arm]), np.array([joint.qvel[0] for joint in arm])))

    def hang_at_the_end(cycle: Cycle) -> None:
        if cycle.sensed.tick.start_ns == 900 * MS:
            for ahead_ms in (249, 750):  # the last command lives for 250 ms
                bench.assembly.world.step_to((900 + ahead_ms) * MS)
                look()

    bench.also = hang_at_the_end
    bench.run("arm_bench", seconds=0.9)
    (at_expiry, speed), (later, at_rest) = seen
    assert np.abs(speed).max() > 0.5
    assert np.abs(at_rest).max() < 1e-4
    assert 0.001 < np.abs(later - at_expiry).max() < 0.2
    assert np.abs(later - GOAL).max() > 0.02
    assert bench.assembly.robot.devices.arm.health().expired_commands == 1


def test_an_emergency_stop_brings_the_arm_to_rest_at_once():
    bench = Bench(to_the_goal)
    bench.run("arm_bench", "robot.operator.events=[{at_s: 0.0, action: enable}, {at_s: 0.8, action: estop}]", seconds=1.5)
    stopped, _ = bench.joints(0.85)
    position, velocity = bench.joints(1.1)
    assert np.abs(bench.joints(0.8)[1]).max() > 0.3
    assert np.abs(velocity).max() < 0.01
    assert 0.001 < np.abs(position - stopped).max() < 0.15
    assert bench.assembly.robot.devices.arm.health().expired_commands == 0


@pytest.mark.parametrize(
    ("broken", "fault"),
    [
        (lambda knots: knots * math.nan, Fault.NON_FINITE_COMMAND),
        (lambda knots: knots + 3.0, Fault.COMMAND_OUT_OF_LIMITS),
        (lambda knots: knots[:, :6], Fault.COMMAND_OUT_OF_LIMITS),
    ],
)
def test_a_trajectory_that_no_arm_can_follow_stops_it_and_the_loop_goes_on(broken, fault):
    def ask(belief: Belief) -> JointTrajectory | None:
        moving = to_the_goal(belief)
        return replace(moving, position_rad=broken(moving.position_rad)) if 16 <= belief.tick < 26 else moving

    bench = Bench(ask)
    bench.run("arm_bench", seconds=3.0)
    assert bench.faults() == {fault}
    assert [cycle.verdict.response is Response.STAND_DOWN for cycle in bench.cycles[16:27]] == [True] * 10 + [False]
    assert np.abs(bench.joints(1.3)[1]).max() < 0.05
    assert np.abs(bench.joints(3.0)[0] - GOAL).max() < 1e-3


MOBILE_MANIPULATOR = (
    "robot={extends: xlerobot, radius_m: 0.35, base: {radius_m: 0.35, mass_kg: 60.0}, arm: {driver: sim_arm, mount_z_m: 0.3}}"
)


@pytest.mark.parametrize("wheels", ["ideal", "rollers"])
def test_an_arm_on_a_mobile_base_is_one_robot(wheels):
    bench = Bench(to_the_goal, base=BodyTwist(0.3, 0.0, 0.0))
    bench.run("static_corridor", MOBILE_MANIPULATOR, f"robot.base.wheels={wheels}", seconds=2.5)
    assert np.abs(bench.joints(2.5)[0] - GOAL).max() < 0.01
    assert not bench.faults()
    assert 0.4 < bench.cycles[-1].belief.odom_from_base.x < 0.75


def test_boxes_with_markers_are_followed_beneath_a_camera() -> None:
    watched = Bench(lambda _: None)
    watched.run("arm_bench_markers", seconds=2.0)
    last = watched.cycles[-1]
    assert last.sensed.truth is not None
    truth = {int(box.name.removeprefix("box_")): box for box in last.sensed.truth.obstacles}
    assert {track.identity for track in last.belief.tracks} >= {1, 2}  # box 0 comes into the picture only now
    for track in last.belief.tracks:
        box = truth[track.identity]
        assert track.position_in_odom == pytest.approx((box.map_from_obstacle.x, box.map_from_obstacle.y), abs=0.02)
        assert track.velocity_in_odom == pytest.approx(box.velocity_m_s, abs=0.05)
