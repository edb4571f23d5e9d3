import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from planners.graceful.planner import Graceful
from planners.mppi.planner import Mppi
from planners.path_following import ARRIVED, ENCLOSED, INVALID, NO_ROUTE, ahead, task_of
from planners.planner import PlannerSetup, no_path
from planners.polyline import arc_length
from planners.regulated_pure_pursuit.planner import RegulatedPurePursuit
from planners.router import Route
from tests.planners.followers import planner_of, route_along
from tests.planners.synthetic import ORIGIN, STANDING, Box, Disc, belief_of

FOLLOWERS = [Graceful, Mppi, RegulatedPurePursuit]
CORNER = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 3.0]])


def task_at(pose=ORIGIN, path=CORNER, obstacles=(), goal_yaw=None, twist=STANDING):
    route = Route(tuple(path[-1]) if len(path) else None, path, 5.0, goal_yaw_in_odom=goal_yaw)
    return task_of(belief_of(list(obstacles), pose, twist), route, 0.3, 0.05, 1.7, 0.05)


@pytest.mark.parametrize("position", [(0.0, 0.0), (0.4, -0.3), (1.99, 0.6), (2.5, 1.0), (-1.0, 0.2)])
def test_the_path_ahead_begins_at_its_point_nearest_to_the_robot(position):
    path, left_m = ahead(CORNER, np.array(position), 100.0, 0.05)
    fine = np.concatenate([np.linspace(a, b, 2001) for a, b in itertools.pairwise(CORNER)])
    distance = np.hypot(*(fine - position).T)
    assert np.hypot(*(path[0] - position)) == pytest.approx(distance.min(), abs=1e-3)
    assert path[-1] == pytest.approx(CORNER[-1])
    assert arc_length(path)[-1] == pytest.approx(left_m, abs=0.03)  # resampling cuts the corner
    assert np.diff(arc_length(path)) == pytest.approx(0.05, abs=0.02)


def test_the_path_ahead_is_cut_at_its_length_and_what_is_left_is_not():
    path, left_m = ahead(CORNER, np.array([0.5, 0.1]), 1.0, 0.05)
    assert left_m == pytest.approx(4.5)
    assert path[-1] == pytest.approx([1.5, 0.0])


def test_at_the_end_of_the_path_two_points_are_left_of_it():
    path, left_m = ahead(CORNER, np.array([2.0, 3.5]), 1.0, 0.05)
    assert left_m == 0.0
    assert path.tolist() == [[2.0, 3.0], [2.0, 3.0]]


@pytest.mark.parametrize(
    ("task", "why"),
    [
        (task_at(path=no_path()), NO_ROUTE),
        (task_at(path=np.array([[0.0, 0.0]])), NO_ROUTE),
        (task_at(path=np.array([[0.0, 0.0], [math.nan, 1.0]])), INVALID),
        (task_at(twist=BodyTwist(math.inf, 0.0, 0.0)), INVALID),
        (task_at(obstacles=[Disc(0.0, 0.0, 0.5)]), ENCLOSED),
        (task_at(SE2(2.0, 2.97)), ARRIVED),
    ],
)
def test_it_says_why_nothing_is_followed(task, why):
    assert task.standing == why
    assert len(task.path) == 0


def test_a_pose_that_is_none_is_refused():
    belief = belief_of([])
    route = Route((1.0, 0.0), np.array([[0.0, 0.0], [1.0, 0.0]]), 1.0)
    assert task_of(replace(belief, odom_from_base=SE2(math.nan, 0.0)), route, 0.3, 0.05, 1.0, 0.05).standing == INVALID


def test_at_the_goal_a_heading_asked_for_is_still_to_be_turned_to():
    task = task_at(SE2(2.0, 2.97, 3.0), goal_yaw=-3.0)
    assert task.standing == ""
    assert task.turn_rad == pytest.approx(2.0 * math.pi - 6.0)


@pytest.mark.parametrize(("wall_x", "required_m"), [(-0.4, 0.3), (-0.2, 0.2)])
def test_inside_its_margin_the_robot_may_go_where_it_is_no_narrower_than_here(wall_x, required_m):
    assert task_at(obstacles=[Box(-3.0, -3.0, wall_x, 3.0)]).required_m == pytest.approx(required_m, abs=0.005)


@pytest.mark.parametrize("cls", FOLLOWERS)
def test_a_robot_without_a_base_is_refused(cls):
    with pytest.raises(ConfigurationError, match=r"planner.name '\w+' drives a base, but the robot has none"):
        cls(cls.Settings(), PlannerSetup(0.05, 0.12, None, 0))


@pytest.mark.parametrize("cls", FOLLOWERS)
@pytest.mark.parametrize(
    ("obstacles", "path", "twist", "why"),
    [
        ([Box(-9.0, -9.0, 9.0, 9.0)], CORNER, STANDING, ENCLOSED),
        ([], [[0.0, 0.0], [math.nan, 1.0]], STANDING, INVALID),
        ([], CORNER, BodyTwist(math.nan, 0.0, 0.0), INVALID),
        ([], [[0.0, 0.0], [0.01, 0.0]], STANDING, ARRIVED),
    ],
    ids=["all occupied", "route that is none", "velocity that is none", "at the goal"],
)
def test_bad_input_makes_a_follower_stand_and_say_why(cls, obstacles, path, twist, why):
    plan = planner_of(cls).plan(belief_of(obstacles, twist=twist), route_along(path))
    assert plan.base == BodyTwist()
    assert plan.diagnostics.standing == why


@pytest.mark.parametrize("cls", FOLLOWERS)
def test_a_path_that_turns_back_on_itself_or_has_double_points_is_no_trouble(cls):
    for path in ([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [1.0, 0.0], [0.2, 0.0]]):
        assert planner_of(cls).plan(belief_of([]), route_along(path)).base.finite


@pytest.mark.parametrize("cls", FOLLOWERS)
def test_the_same_situation_gives_the_same_command_to_the_bit(cls):
    belief, route = belief_of([Disc(1.0, 0.3, 0.2)], twist=BodyTwist(0.2, 0.0, 0.1)), route_along(CORNER)
    first, second = planner_of(cls), planner_of(cls)
    for _ in range(3):
        assert first.plan(belief, route).base == second.plan(belief, route).base
