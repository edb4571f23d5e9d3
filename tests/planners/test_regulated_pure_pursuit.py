import math

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from planners.regulated_pure_pursuit.kernels import approaching, carrot_on, collides_along, curvature_to, regulated
from planners.regulated_pure_pursuit.planner import RegulatedPurePursuit
from tests.planners.followers import PERIOD_S, WORLDS, planner_of, route_along, run
from tests.planners.synthetic import DIFFERENTIAL, OMNI, Box, belief_of

LINE = np.array([[0.0, 0.0], [5.0, 0.0]])


def rpp(limits=DIFFERENTIAL, **settings):
    return planner_of(RegulatedPurePursuit, limits, **settings)


@pytest.mark.parametrize(("limits", "obstacles", "goal"), WORLDS.values(), ids=WORLDS)
def test_it_arrives_without_touching(limits, obstacles, goal):
    trace = run(rpp(limits), obstacles, goal, limits)
    assert trace.reached(*goal, tolerance_m=0.21)
    assert trace.min_clearance_m > 0.08


@pytest.mark.parametrize("distance_m", [0.3, 0.9, 2.0])
@pytest.mark.parametrize("aside_m", [0.0, 0.2, -0.25])
def test_the_carrot_lies_on_the_path_at_the_look_ahead_distance(distance_m, aside_m):
    path = np.array([[0.0, 0.0], [0.7, 0.0], [0.7, 4.0]])
    x, y = carrot_on(path, 0.0, aside_m, distance_m)
    assert math.hypot(x, y - aside_m) == pytest.approx(distance_m)
    assert min(abs(y), abs(x - 0.7)) == pytest.approx(0.0, abs=1e-12)


def test_the_carrot_is_the_path_s_end_where_that_is_near_and_its_start_where_all_is_far():
    path = np.array([[0.0, 0.0], [0.5, 0.0]])
    assert carrot_on(path, 0.0, 0.0, 0.9) == (0.5, 0.0)
    assert carrot_on(path, 0.0, 2.0, 0.9) == (0.0, 0.0)


@pytest.mark.parametrize(("radius_m", "angle"), [(0.5, 0.8), (-1.2, 0.5), (3.0, 0.2)])
def test_the_curvature_is_that_of_the_circle_through_the_carrot(radius_m, angle):
    ahead_m, left_m = abs(radius_m) * math.sin(angle), radius_m * (1.0 - math.cos(angle))
    assert curvature_to(ahead_m, left_m) == pytest.approx(1.0 / radius_m)


def test_regulation_is_the_lower_of_both_heuristics_and_at_least_the_slowest():
    assert regulated(0.5, 0.0, 9.0, 0.9, 0.6, 1.0, 0.1) == 0.5
    assert regulated(0.5, -2.0, 9.0, 0.9, 0.6, 1.0, 0.1) == pytest.approx(0.5 * 0.5 / 0.9)
    assert regulated(0.5, 0.0, 0.3, 0.9, 0.6, 0.8, 0.1) == pytest.approx(0.5 * 0.8 * 0.3 / 0.6)
    assert regulated(0.5, 2.0, 0.3, 0.9, 0.6, 1.0, 0.1) == pytest.approx(0.25)
    assert regulated(0.5, 50.0, 0.3, 0.9, 0.6, 1.0, 0.1) == 0.1
    assert regulated(0.5, 50.0, 0.1, 0.0, 0.0, 1.0, 0.1) == 0.5


def test_it_approaches_the_end_in_proportion_to_the_distance():
    assert approaching(0.5, 2.0, 0.3, 0.6, 0.05) == 0.5  # a winding way whose end happens to be near
    assert approaching(0.5, 0.3, 0.3, 0.6, 0.05) == pytest.approx(0.25)
    assert approaching(0.5, 0.01, 0.01, 0.6, 0.05) == 0.05
    assert approaching(0.03, 0.01, 0.01, 0.6, 0.05) == 0.03


@pytest.mark.parametrize("turn", [0.0, 0.6, -0.6])
def test_the_arc_that_is_checked_is_the_arc_that_is_driven(turn):
    pose, field = SE2(0.3, -0.2, 0.7), np.full((80, 80), 9.0, np.float32)
    hit, arc = collides_along(np.array([0.3, -0.2, 0.7]), 0.5, turn, 9.0, 1.0, 0.1, field, -2.0, -2.0, 0.05)
    there = pose.integrate(0.5, 0.0, turn, 1.0)
    assert not hit
    assert arc[-1] == pytest.approx([there.x, there.y], abs=1e-9)


@pytest.mark.parametrize(("wall_x", "collides"), [(0.6, True), (0.8, False)])
def test_a_collision_counts_within_the_time_that_is_looked_ahead(wall_x, collides):
    belief = belief_of([Box(wall_x, -3.0, 2.5, 3.0)], twist=BodyTwist(0.5, 0.0, 0.0))
    plan = rpp(regulate_by_clearance=False).plan(belief, route_along(LINE))
    assert (plan.base == BodyTwist()) == collides
    assert plan.diagnostics.standing == ("collision ahead on the arc" if collides else "")
    assert rpp(time_to_collision_s=0.0).plan(belief, route_along(LINE)).base.vx > 0.2


def test_no_farther_than_the_carrot_is_looked_for_collisions():
    """The path turns off before the wall: what lies beyond the carrot is not on the way."""
    belief = belief_of([Box(0.7, -3.0, 2.5, 3.0)], twist=BodyTwist(0.2, 0.0, 0.0))
    path = np.array([[0.0, 0.0], [0.3, 0.0], [0.3, 3.0]])
    assert rpp().plan(belief, route_along(path)).base.vx > 0.0


def test_a_path_aside_is_turned_to_on_the_spot_no_faster_than_can_be_stopped():
    path = np.array([[0.0, 0.0], [-1.0, 1.0]])
    turning = rpp().plan(belief_of([], twist=BodyTwist(0.0, 0.0, 1.2)), route_along(path))
    assert turning.base.vx == 0.0
    assert turning.base.wz == pytest.approx(1.2)
    assert turning.diagnostics.rotating
    from_rest = rpp().plan(belief_of([]), route_along(path))
    assert from_rest.base.wz == pytest.approx(DIFFERENTIAL.acceleration.wz * PERIOD_S)
    assert rpp(rotate_to_heading=False).plan(belief_of([]), route_along(path)).base.vx != 0.0


def test_it_turns_to_the_heading_that_the_goal_asks_for():
    trace = run(rpp(), [], (2.0, 0.0), DIFFERENTIAL, goal_yaw=2.0)
    assert trace.reached(2.0, 0.0, tolerance_m=0.1)
    assert trace.poses[-1].yaw == pytest.approx(2.0, abs=0.1)


def test_the_look_ahead_grows_with_the_speed():
    reached = []
    for vx in (0.0, 0.4, 1.0):
        plan = rpp().plan(belief_of([], twist=BodyTwist(vx, 0.0, 0.0)), route_along(LINE))
        reached.append(plan.diagnostics.lookahead_m)
        (carrot,) = next(d for d in plan.drawings if d.name == "lookahead").points_in_odom
        assert carrot == pytest.approx([reached[-1], 0.0])
    assert reached == pytest.approx([0.3, 0.6, 0.9])


def test_a_fixed_look_ahead_gives_the_curvature_where_that_is_asked_for():
    bend = route_along(np.array([[0.0, 0.0], [0.5, 0.0], [1.5, 0.9]]))
    belief = belief_of([], twist=BodyTwist(0.5, 0.0, 0.0))
    adaptive, fixed = (rpp(fixed_curvature_lookahead=f, curvature_lookahead_m=0.45).plan(belief, bend) for f in (False, True))
    assert fixed.diagnostics.curvature_per_m == pytest.approx(0.0, abs=1e-9)
    assert adaptive.diagnostics.curvature_per_m > 0.1


@pytest.mark.parametrize("limits", [DIFFERENTIAL, OMNI], ids=["differential", "omni"])
def test_it_never_asks_for_more_than_the_base_does_nor_for_sideways_motion(limits):
    slow = type(limits)(BodyTwist(0.2, limits.velocity.vy, 0.3), limits.acceleration, limits.jerk, limits.stop_deceleration)
    bend = route_along(np.array([[0.0, 0.0], [0.25, 0.12], [0.5, 1.0]]))
    twist = rpp(slow, rotate_min_angle_rad=1.5).plan(belief_of([]), bend).base
    assert 0.0 < twist.vx <= 0.2
    assert twist.vy == 0.0
    assert abs(twist.wz) <= 0.3 + 1e-12


def test_a_goal_inside_a_wall_is_not_driven_into():
    trace = run(rpp(), [Box(1.5, -3.0, 2.5, 3.0)], (2.0, 0.0), DIFFERENTIAL, duration_s=10.0)
    assert trace.min_clearance_m > 0.0
