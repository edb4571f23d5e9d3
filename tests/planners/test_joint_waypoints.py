"""The way-point planner: its motions keep the limits by closed form, its mission ends, and what was disturbed is planned anew."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from drivers.interface.arm_motion import PANDA, TrajectoryFollower
from drivers.interface.errors import ConfigurationError
from drivers.interface.samples import JointSample, Stamp
from planners.joint_waypoints.planner import JointWaypoints
from planners.joint_waypoints.profile import duration_s, knots_between
from planners.planner import PlannerSetup
from planners.router import Route
from sim_drivers.arm_model import READY_RAD
from tests.planners.synthetic import belief_of

READY = np.array(READY_RAD)
WAYPOINTS = (tuple((READY + 0.4).tolist()), tuple((READY + np.array([-0.5, 0.2, 0.0, 0.0, 0.3, 0.0, 1.0])).tolist()))
SETUP = PlannerSetup(0.05, 0.13, None, 0, PANDA)
NOWHERE = Route(None, np.zeros((0, 2)), 0.0)
TICK_NS = 50_000_000


def planner(**settings):
    return JointWaypoints(JointWaypoints.Settings(waypoints_rad=WAYPOINTS, **settings), SETUP)


def belief(tick, position, velocity=None):
    now_ns = tick * TICK_NS
    velocity = np.zeros(7) if velocity is None else velocity
    joints = JointSample(Stamp(now_ns, now_ns, tick), position, velocity, np.zeros(7))
    return replace(belief_of([]), tick=tick, stamp_ns=now_ns, joints=joints)


def test_the_profile_keeps_every_limit_and_uses_one_of_them_fully():
    shares, end = (0.5, 0.4, 0.3), READY + np.array([1.0, -0.3, 0.5, 0.4, -1.2, 0.2, 0.1])
    took_s = duration_s(end - READY, PANDA, shares)
    time_s, position, _ = knots_between(READY, end, took_s, 20_001)
    step_s, used = time_s[1], []
    derivative = position
    for share, limit in zip(shares, (PANDA.velocity_rad_s, PANDA.acceleration_rad_s2, PANDA.jerk_rad_s3), strict=True):
        derivative = np.diff(derivative, axis=0) / step_s
        used.append(float((np.abs(derivative).max(axis=0) / (share * limit)).max()))
    assert max(used) == pytest.approx(1.0, abs=0.01)


def test_the_knots_are_dense_enough_for_cubics_between_them():
    time_s, position, velocity = knots_between(READY, READY + 1.0, 2.0, 17)
    dense = np.linspace(0.0, 2.0, 1000)
    _, exact, _ = knots_between(READY, READY + 1.0, 2.0, 1000)
    assert np.abs(CubicHermiteSpline(time_s, position, velocity)(dense) - exact).max() < 1e-4


def test_it_goes_through_all_way_points_in_order_and_says_when_it_is_done():
    one, arm, tick, seen = planner(rounds=2), TrajectoryFollower(PANDA, READY), 0, []
    plan = one.plan(belief(tick, READY), NOWHERE)
    while not plan.accomplished:
        assert plan.accomplished is False
        assert PANDA.fault_of(plan.arm) == ""
        arm.follow(plan.arm, 10**18)
        for millisecond in range(1, 51):
            arm.step(tick * TICK_NS + millisecond * 1_000_000)
        tick += 1
        seen.append(plan.diagnostics.waypoint)
        plan = one.plan(belief(tick, arm.position_rad, arm.velocity_rad_s), NOWHERE)
        assert tick < 1000
    assert plan.arm is None
    assert sorted(set(seen)) == [0, 1, 2, 3]
    assert seen == sorted(seen)
    assert arm.position_rad == pytest.approx(np.array(WAYPOINTS[1]), abs=0.02)


def test_the_same_trajectory_is_sent_again_until_the_arm_is_astray():
    one = planner()
    first = one.plan(belief(0, READY), NOWHERE).arm
    assert one.plan(belief(1, READY), NOWHERE).arm is first
    late = one.plan(belief(40, READY), NOWHERE).arm  # it was held for two seconds
    assert late is not first
    assert late.start_ns == 40 * TICK_NS
    assert late.position_rad[0] == pytest.approx(READY)


def test_a_restored_planner_goes_on_alike():
    one, other = planner(), planner()
    one.plan(belief(0, READY), NOWHERE)
    other.restore(one.snapshot())
    plans = [each.plan(belief(3, READY + 1e-3), NOWHERE).arm for each in (one, other)]
    assert plans[0].start_ns == plans[1].start_ns == 0
    assert plans[0].position_rad.tobytes() == plans[1].position_rad.tobytes()


def test_without_joints_it_asks_for_nothing_and_is_not_done():
    plan = planner().plan(replace(belief_of([]), joints=None), NOWHERE)
    assert plan.arm is None
    assert plan.accomplished is False


@pytest.mark.parametrize(
    ("waypoints", "setup", "words"),
    [
        ((), SETUP, "no way-point"),
        ((READY_RAD[:6],), SETUP, "row 0 has 6 values, but the arm has 7 joints"),
        ((READY_RAD, (*READY_RAD[:3], 0.5, *READY_RAD[4:])), SETUP, "row 1 has 0.5 rad for joint 4"),
        ((READY_RAD,), replace(SETUP, arm_limits=None), "'joint_waypoints' moves an arm"),
    ],
)
def test_refuses_way_points_that_cannot_be(waypoints, setup, words):
    with pytest.raises(ConfigurationError, match=words):
        JointWaypoints(JointWaypoints.Settings(waypoints_rad=waypoints), setup)
