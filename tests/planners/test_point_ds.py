import math
from dataclasses import replace

import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from planners.planner import PlannerSetup
from planners.point_ds.planner import PointAttractor
from planners.router import Route, RouterSetup
from planners.routers.grid import GridRouter
from planners.routers.straight import StraightRouter
from planners.shield import ShieldSetup
from planners.shields.field_cbf import FieldCbf
from tests.planners.synthetic import DIFFERENTIAL, OMNI, Box, Disc, belief_of, drive, mission_to

PERIOD_S, RADIUS_M = 0.05, 0.12


def planner_of(limits=OMNI, **settings):
    planner = PointAttractor(PointAttractor.Settings(**settings), PlannerSetup(PERIOD_S, RADIUS_M, limits, 0))
    planner.warm_up()
    return planner


def straight():
    return StraightRouter(StraightRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))


def cbf():
    return FieldCbf(FieldCbf.Settings(), ShieldSetup(PERIOD_S, RADIUS_M, OMNI))


def twist_towards(x, y, yaw=0.0, **settings):
    belief = belief_of([], SE2(0.0, 0.0, yaw))
    return planner_of(**settings).plan(belief, straight().route(belief, mission_to(x, y))).base


@pytest.mark.parametrize("yaw", [0.0, 0.6, -2.0])
def test_velocity_points_at_the_goal_in_the_body_frame(yaw):
    twist = twist_towards(1.0, 1.0, yaw)
    assert math.atan2(twist.vy, twist.vx) == pytest.approx(math.remainder(math.pi / 4 - yaw, 2 * math.pi))
    assert twist.wz == pytest.approx(max(-1.2, min(1.2, 2.0 * math.remainder(math.pi / 4 - yaw, 2 * math.pi))))
    assert twist.speed_m_s <= 0.5 + 1e-12


def test_speed_is_capped_far_off_and_falls_off_near_the_goal():
    assert twist_towards(9.0, 0.0).vx == pytest.approx(0.5)
    assert twist_towards(0.2, 0.0).vx == pytest.approx(0.2)


def test_axis_caps_shrink_the_velocity_without_turning_it():
    twist = twist_towards(3.0, 4.0, speed_m_s=2.0, attraction_per_s=5.0)
    assert twist.vy == pytest.approx(0.5)
    assert twist.vx == pytest.approx(0.375)


def test_reverse_is_refused_where_the_base_may_not():
    belief = belief_of([])
    planner = planner_of(replace(OMNI, reverse=False))
    twist = planner.plan(belief, straight().route(belief, mission_to(-2.0, 0.1))).base
    assert twist.vx >= 0.0
    assert twist.wz == pytest.approx(1.2)


def test_route_can_attract_instead_of_the_goal():
    belief = belief_of([Disc(1.0, 0.05, 0.4)])
    route = GridRouter(GridRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M)).route(belief, mission_to(2.5, 0.0))
    assert abs(planner_of().plan(belief, route).base.vy) < 1e-9
    assert planner_of(attractor="route", look_ahead_m=0.8).plan(belief, route).base.vy < -0.1


def test_without_a_route_it_stands():
    belief = belief_of([])
    empty = straight().route(belief, mission_to(2.0, 0.0)).path_in_odom[:0]
    assert planner_of().plan(belief, Route((2.0, 0.0), empty, 0.0, True)).base == BodyTwist()


@pytest.mark.parametrize("limits", [DIFFERENTIAL, None])
def test_a_base_that_cannot_strafe_is_refused_in_one_sentence(limits):
    with pytest.raises(ConfigurationError, match=r"planner.name 'point_ds'"):
        PointAttractor(PointAttractor.Settings(), PlannerSetup(PERIOD_S, RADIUS_M, limits, 0))


@pytest.mark.parametrize(
    ("obstacles", "goal"),
    [([], (-2.0, 1.0)), ([Disc(2.0, 0.15, 0.3)], (4.0, 0.0)), ([Disc(2.5, -2.0, 0.25, 0.0, 0.5)], (5.0, 0.0))],
)
def test_with_its_shield_it_arrives_untouched(obstacles, goal):
    trace = drive(planner_of(), straight(), cbf(), obstacles, goal, duration_s=30.0)
    assert trace.reached(*goal)
    assert trace.min_clearance_m > 0.05


def test_wall_in_the_way_holds_it_off():
    trace = drive(planner_of(), straight(), cbf(), [Box(1.5, -3, 1.7, 3)], (4.0, 0.0), duration_s=8.0)
    assert trace.min_clearance_m > 0.08
    assert trace.twists[-1].speed_m_s < 0.05


def test_answers_repeat_after_restoring():
    belief = belief_of([])
    route = straight().route(belief, mission_to(2.0, 1.0))
    first, second = planner_of(), planner_of()
    second.restore(first.snapshot())
    assert first.plan(belief, route).base == second.plan(belief, route).base
