import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from planners.dwa.kernels import Surroundings, advance, free_travel
from planners.dwa.planner import DynamicWindow
from planners.dwa.window import dynamic_window
from planners.planner import PlannerSetup
from planners.router import RouterSetup
from planners.routers.grid import GridRouter
from planners.routers.straight import StraightRouter
from planners.shield import ShieldSetup
from planners.shields.none import NoShield
from tests.planners.synthetic import DIFFERENTIAL, OMNI, Box, Disc, belief_of, drive, mission_to

PERIOD_S, RADIUS_M = 0.05, 0.12
WALLS = [Box(-1, -1.1, 9, -1.0), Box(-1, 1.0, 9, 1.1)]


def planner_of(limits=OMNI, **settings):
    planner = DynamicWindow(DynamicWindow.Settings(**settings), PlannerSetup(PERIOD_S, RADIUS_M, limits, 0))
    planner.warm_up()
    return planner


def straight():
    return StraightRouter(StraightRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))


def run(obstacles, goal, limits=OMNI, router=None, planner=None, **options):
    router = router or GridRouter(GridRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
    shield = NoShield(NoShield.Settings(), ShieldSetup(PERIOD_S, RADIUS_M, limits))
    return drive(planner or planner_of(limits), router, shield, obstacles, goal, limits=limits, **options)


@pytest.mark.parametrize("limits", [OMNI, DIFFERENTIAL], ids=["omni", "differential"])
@pytest.mark.parametrize(
    ("obstacles", "goal"),
    [
        ([], (3.0, 0.0)),
        ([], (-2.0, 0.5)),
        ([Disc(1.5, 0.05, 0.3)], (3.0, 0.0)),
        ([Box(1.5, -3, 1.7, -0.3), Box(1.5, 0.3, 1.7, 3)], (3.0, 0.0)),
        ([*WALLS, Disc(1.5, 0.3, 0.25), Disc(3.0, -0.4, 0.25)], (4.5, 0.0)),
        ([Box(1.5, -1, 1.7, 1), Box(0.8, -1.1, 1.7, -1), Box(0.8, 1, 1.7, 1.1)], (3.0, 0.0)),
    ],
    ids=["open", "behind", "pillar", "gap", "slalom", "dead end"],
)
def test_it_arrives_without_touching(obstacles, goal, limits):
    trace = run(obstacles, goal, limits, duration_s=25.0, seen_m=2.5)
    assert trace.reached(*goal)
    assert trace.min_clearance_m > 0.08


@pytest.mark.parametrize("limits", [OMNI, DIFFERENTIAL], ids=["omni", "differential"])
def test_it_stops_before_a_wall_in_its_way(limits):
    trace = run([Box(1.5, -3, 1.7, 3)], (4.0, 0.0), limits, router=straight(), duration_s=8.0)
    assert trace.min_clearance_m > 0.08
    assert trace.poses[-1].x > 0.9


def test_it_passes_a_crossing_pillar_that_leaves_room():
    trace = run([*WALLS, Disc(4.0, 0.45, 0.2, -0.4)], (4.5, 0.0), duration_s=25.0)
    assert trace.reached(4.5, 0.0)
    assert trace.min_clearance_m > 0.05


@pytest.mark.parametrize("limits", [OMNI, DIFFERENTIAL], ids=["omni", "differential"])
def test_commands_stay_inside_caps_window_and_kind_of_base(limits):
    planner = planner_of(limits)
    trace = run([Disc(1.5, 0.05, 0.3)], (3.0, 0.0), limits, planner=planner, duration_s=25.0)
    for now, plan in zip(trace.twists, trace.plans, strict=False):
        twist = plan.base
        assert abs(twist.vx) <= limits.velocity.vx
        assert abs(twist.vy) <= limits.velocity.vy
        assert abs(twist.wz) <= limits.velocity.wz
        if not plan.diagnostics.braking:
            assert abs(twist.vx - now.vx) <= limits.acceleration.vx * 0.25 + 1e-9
    assert max(t.speed_m_s for t in trace.twists) == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("limits", [OMNI, DIFFERENTIAL], ids=["omni", "differential"])
def test_reverse_is_refused_where_the_base_may_not(limits):
    trace = run([], (-2.0, 0.0), replace(limits, reverse=False), duration_s=20.0)
    assert min(t.vx for t in trace.twists) >= 0.0
    assert trace.reached(-2.0, 0.0)


def test_omni_base_looks_where_it_drives():
    trace = run([], (0.0, 3.0), duration_s=20.0, seen_m=2.5)
    assert trace.reached(0.0, 3.0)
    assert trace.poses[-1].yaw == pytest.approx(math.pi / 2, abs=0.5)


def test_unknown_ahead_is_a_stopping_constraint_only_where_the_setting_says_so():
    cautious = run([], (4.0, 0.0), seen_m=0.0, duration_s=5.0)
    bold = run([], (4.0, 0.0), planner=planner_of(stop_before_unknown=False), seen_m=0.0, duration_s=15.0)
    assert cautious.poses[-1].distance(SE2()) < 0.05
    assert any(plan.diagnostics.looking_around for plan in cautious.plans)
    assert bold.reached(4.0, 0.0)


def test_it_can_stop_before_the_edge_of_what_was_seen():
    pose, belief = SE2(), belief_of([], twist=BodyTwist(0.5, 0.0, 0.0), seen_m=0.45)
    plan = planner_of().plan(belief, straight().route(belief, mission_to(4.0, 0.0)))
    free_m = 0.45 - 0.25
    assert plan.base.vx * 0.1 + plan.base.vx**2 / 4.0 <= free_m + 0.05
    assert pose.x == 0.0


def test_nothing_admissible_brakes():
    belief = belief_of([Box(0.24, -3, 1.0, 3)], twist=BodyTwist(0.7, 0.0, 0.0))
    plan = planner_of().plan(belief, straight().route(belief, mission_to(4.0, 0.0)))
    assert plan.base == BodyTwist()
    assert plan.diagnostics.braking


@pytest.mark.parametrize("limits", [OMNI, DIFFERENTIAL], ids=["omni", "differential"])
@pytest.mark.parametrize(
    ("obstacles", "pose", "seen_m", "goal"),
    [
        ([Box(-9, -9, 9, 9)], SE2(), None, (4.0, 0.0)),
        ([], SE2(), 0.0, (4.0, 0.0)),
        ([Disc(0.0, 0.0, 0.3)], SE2(), None, (4.0, 0.0)),
        ([Disc(2.0, 0.0, 0.5)], SE2(), None, (2.0, 0.0)),
        ([], SE2(), None, (0.0, 0.0)),
    ],
    ids=["all occupied", "all unknown", "inside an obstacle", "goal in a wall", "at the goal"],
)
def test_bad_input_gives_a_finite_harmless_command(limits, obstacles, pose, seen_m, goal):
    belief = belief_of(obstacles, pose, seen_m=seen_m)
    for router in (straight(), GridRouter(GridRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))):
        plan = planner_of(limits).plan(belief, router.route(belief, mission_to(*goal)))
        assert plan.base.finite
        stop_m = plan.base.speed_m_s * 0.1 + plan.base.speed_m_s**2 / 4.0
        room = min((float(o.distance(0.0, 0.0)) for o in obstacles), default=np.inf)
        assert plan.base == BodyTwist() or stop_m < room - RADIUS_M
        if seen_m is not None:
            assert plan.base.speed_m_s == 0.0


def test_inside_the_margin_it_moves_away_but_not_nearer():
    wall = Box(-3.0, 0.16, 3.0, 0.5)
    trace = run([wall], (2.5, -0.3), duration_s=15.0)
    assert trace.reached(2.5, -0.3)
    assert trace.min_clearance_m > 0.0


def test_after_standing_it_looks_around_once_and_rests():
    belief = belief_of([], seen_m=0.0)
    planner, route = planner_of(), straight().route(belief, mission_to(4.0, 0.0))
    turning = [planner.plan(belief, route).diagnostics.looking_around for _ in range(238)]
    assert not any(turning[:25])
    assert sum(turning) * PERIOD_S * 0.6 == pytest.approx(2.0 * math.pi, rel=0.15)


def test_restored_planner_goes_on_identically():
    belief = belief_of([], seen_m=0.0)
    route = straight().route(belief, mission_to(4.0, 0.0))
    first, second = planner_of(), planner_of()
    for _ in range(60):
        first.plan(belief, route)
    second.restore(first.snapshot())
    for _ in range(250):
        assert first.plan(belief, route).base == second.plan(belief, route).base


def test_two_runs_are_equal_to_the_bit():
    first, second = (run([Disc(1.5, 0.05, 0.3)], (3.0, 0.0), duration_s=15.0) for _ in range(2))
    assert first.poses == second.poses
    assert first.twists == second.twists


def test_a_robot_without_a_base_is_refused():
    with pytest.raises(ConfigurationError, match=r"planner.name 'dwa'"):
        DynamicWindow(DynamicWindow.Settings(), PlannerSetup(PERIOD_S, RADIUS_M, None, 0))


@pytest.mark.parametrize("twist", [(0.4, 0.0, 0.8), (0.3, -0.2, -1.1), (0.5, 0.1, 0.0)])
def test_arcs_are_exact(twist):
    pose = SE2(0.3, -0.2, 0.8)
    expected = pose.integrate(*twist, 1.3)
    x, y, yaw = advance(np.array([pose.x, pose.y, pose.yaw]), np.array(twist), 1.3)
    assert (x, y) == pytest.approx((expected.x, expected.y))
    assert yaw == pytest.approx(0.8 + twist[2] * 1.3)


@pytest.mark.parametrize("bearing", [0.0, 0.7, -1.2])
def test_free_travel_ends_where_the_clearance_falls_short(bearing):
    belief = belief_of([Disc(1.5 * math.cos(bearing), 1.5 * math.sin(bearing), 0.3)])
    lattice = belief.grid.lattice
    around = Surroundings(
        belief.clearance.clearance_m, belief.grid.label, lattice.x_m, lattice.y_m, lattice.cell_m, required_m=0.2, body_m=-1.0
    )
    free_m, least_m = free_travel(np.array([0.0, 0.0, bearing]), np.array([0.5, 0.0, 0.0]), 2.0, 20, around)
    assert free_m == pytest.approx(1.0, abs=0.02)
    assert least_m == 0.2


@pytest.mark.parametrize("now", [BodyTwist(), BodyTwist(0.3, -0.1, 0.5), BodyTwist(5.0, 0.0, 0.0)])
@pytest.mark.parametrize("limits", [OMNI, DIFFERENTIAL], ids=["omni", "differential"])
def test_window_is_what_the_accelerations_reach_inside_the_caps(now, limits):
    samples = dynamic_window(now, limits, 0.2, (11, 7, 11), 10.0)
    cap, reach = limits.velocity, limits.acceleration
    for axis, name in enumerate(("vx", "vy", "wz")):
        values, limit = samples[:, axis], getattr(cap, name)
        start = min(max(getattr(now, name), -limit), limit)
        assert values.min() >= max(-limit, start - getattr(reach, name) * 0.2) - 1e-12
        assert values.max() <= min(limit, start + getattr(reach, name) * 0.2) + 1e-12
    assert (samples == 0.0).all(axis=1).any() == (now.vx < 1.0)


@pytest.mark.parametrize("limits", [OMNI, DIFFERENTIAL], ids=["omni", "differential"])
@pytest.mark.parametrize("goal", [(3.0, 0.0), (-2.0, 0.5)])
def test_it_arrives_with_what_a_camera_sees_now_and_no_memory(limits, goal):
    trace = run([Disc(1.5, 0.05, 0.3)], goal, limits, duration_s=25.0, seen_m=2.5, fov_rad=1.5)
    assert trace.reached(*goal)
    assert trace.min_clearance_m > 0.08
