"""What the clearance-manifold planner does while its way is blocked."""

import math
from dataclasses import replace

import pytest

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.geometry import SE2
from planners.clearance_manifold.planner import ClearanceManifold
from planners.clearance_manifold.settings import ClearanceManifoldSettings
from planners.planner import PlannerSetup, no_path
from planners.router import Route, RouterSetup
from planners.routers.straight import StraightRouter
from tests.planners.synthetic import DIFFERENTIAL, OMNI, Box, Disc, belief_of, mission_to

PERIOD_S, RADIUS_M = 0.05, 0.12
WALLS = (Box(-4, 1.0, 12, 1.2), Box(-4, -1.2, 12, -1.0))
SHUT = (*WALLS, Box(1.5, -1.0, 1.7, 1.0))
GOAL = (9.0, 0.0)
BLOCKED = Route(GOAL, no_path(), 0.0, blocked=True)


class Robot:
    """Turns as it is told."""

    def __init__(self, limits: BaseLimits = OMNI, **settings: float | str) -> None:
        chosen = ClearanceManifoldSettings(waiting=settings)
        self.planner = ClearanceManifold(chosen, PlannerSetup(PERIOD_S, RADIUS_M, limits, 0))
        self.pose, self.tick = SE2(), 0
        self.twist = BodyTwist()

    def step(self, obstacles, route=None):
        belief = belief_of(obstacles, self.pose, self.twist, tick=self.tick)
        belief = replace(belief, stamp_ns=1_000_000_000 + round(self.tick * PERIOD_S * 1e9))
        straight = StraightRouter(StraightRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
        plan = self.planner.plan(belief, straight.route(belief, mission_to(*GOAL)) if route is None else route)
        self.twist, self.tick = plan.base, self.tick + 1
        self.pose = self.pose.integrate(plan.base.vx, plan.base.vy, plan.base.wz, PERIOD_S)
        return plan


@pytest.mark.parametrize("yaw", [2.5, -1.0])
def test_it_turns_to_what_blocks_the_way_and_looks_at_it(yaw: float) -> None:
    robot = Robot(patience_s=60.0)
    robot.step(WALLS)
    robot.pose = SE2(0.0, 0.0, yaw)
    for _ in range(120):
        plan = robot.step(SHUT, BLOCKED)
        assert (plan.base.vx, plan.base.vy) == (0.0, 0.0)
        assert plan.diagnostics.stopped == "the way is blocked"
    assert abs(robot.pose.yaw) < 0.1
    assert plan.base.wz == 0.0


def test_after_its_patience_it_looks_all_around() -> None:
    robot = Robot(patience_s=1.0, turn_rad_s=0.8)
    robot.step(WALLS)
    turned = sum(robot.step(SHUT, BLOCKED).base.wz * PERIOD_S for _ in range(240))
    assert turned > 2.0 * math.pi


def test_it_drives_on_when_the_way_is_free_and_is_patient_again_the_next_time() -> None:
    robot = Robot(patience_s=1.0)
    robot.step(WALLS)
    for _ in range(60):
        robot.step(SHUT, BLOCKED)
    robot.pose = SE2()
    for _ in range(20):
        plan = robot.step(WALLS)
    assert plan.base.vx > 0.2
    assert robot.step(SHUT, BLOCKED).base.wz == 0.0


def test_who_never_had_a_way_stands() -> None:
    robot = Robot(patience_s=0.0)
    assert robot.step(SHUT, BLOCKED).base == BodyTwist()


def test_a_restored_planner_waits_on() -> None:
    one, other = Robot(patience_s=1.0), Robot(patience_s=1.0)
    one.step(WALLS)
    for _ in range(30):
        one.step(SHUT, BLOCKED)
    other.planner.restore(one.planner.snapshot())
    other.pose, other.tick, other.twist = one.pose, one.tick, one.twist
    assert other.step(SHUT, BLOCKED).base == one.step(SHUT, BLOCKED).base != BodyTwist()


@pytest.mark.parametrize("line_m", [0.0, 0.25, -0.1])
def test_who_comes_along_while_it_waits_is_given_way_to_and_looked_at(line_m: float) -> None:
    """He comes from behind at 0.7 m/s; standing still, the robot would be met."""
    robot, least_m = Robot(blocked="make_way", patience_s=1.0, turn_rad_s=1.2), math.inf
    robot.step(WALLS)
    for tick in range(120):
        walker = Disc(-2.5 + 0.7 * PERIOD_S * tick, line_m, 0.25, 0.7, 0.0)
        plan = robot.step((*SHUT, walker), BLOCKED)
        least_m = min(least_m, float(walker.distance(robot.pose.x, robot.pose.y)) - RADIUS_M)
        if tick == 50:
            assert abs(math.atan2(walker.y - robot.pose.y, walker.x - robot.pose.x) - robot.pose.yaw) % (2.0 * math.pi) < 0.5
    assert least_m > 0.05
    assert plan.diagnostics.refused


def test_it_makes_way_for_nobody_where_it_is_to_stand_or_has_no_goal() -> None:
    walker = Disc(-1.0, 0.1, 0.25, 0.7, 0.0)
    for robot, route in ((Robot(), BLOCKED), (Robot(blocked="make_way"), Route(None, no_path(), 0.0, blocked=True))):
        robot.step(WALLS)
        for tick in range(20):
            base = robot.step((*SHUT, walker.at(tick * PERIOD_S)), route).base
            assert (base.vx, base.vy) == (0.0, 0.0)


def test_a_base_that_cannot_strafe_steers_while_it_makes_way() -> None:
    """It looks to its left when he comes along the corridor from its right: it drives aside on a straight line, not a curve."""
    robot = Robot(DIFFERENTIAL, blocked="make_way", patience_s=0.0, turn_rad_s=1.2)
    robot.step(WALLS)
    robot.pose = SE2(0.0, 0.0, 0.5 * math.pi)
    for tick in range(50):
        plan = robot.step((*SHUT, Disc(-2.0 + 0.7 * PERIOD_S * tick, -0.05, 0.25, 0.7, 0.0)), BLOCKED)
        assert plan.base.vx == 0.0 or abs(plan.base.wz) < 0.3
    assert abs(robot.pose.y) > 0.25  # on either hand, forwards or backwards,
    assert abs(robot.pose.x) < 0.15
