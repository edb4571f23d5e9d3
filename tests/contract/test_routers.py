"""Every router: a route leads from the robot towards the goal, in odom, or says that there is none."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal, Mission
from planners.router import RouterSetup
from runtime.registry import Part, load, names
from tests.contract.facts import all_finite
from tests.contract.streams import MISSION, PERIOD_S, RADIUS_M, TICKS, beliefs

ROUTERS = names(Part.ROUTER)


def router_for(name: str):
    cls = load(Part.ROUTER, name)
    return cls(cls.Settings(), RouterSetup(PERIOD_S, RADIUS_M))


@pytest.mark.parametrize("name", ROUTERS)
def test_a_route_is_finite_and_begins_at_the_robot(name):
    router = router_for(name)
    for belief in beliefs("omni"):
        route = router.route(belief, MISSION)
        assert all_finite((route.goal_in_odom, route.path_in_odom, route.length_m))
        assert route.path_in_odom.shape[1:] == (2,)
        assert route.length_m >= 0.0
        if not route.empty:
            robot = belief.odom_from_base
            assert np.allclose(route.path_in_odom[0], (robot.x, robot.y), atol=0.05)
            assert route.length_m >= 0.9 * math.dist(route.path_in_odom[0], route.path_in_odom[-1])


@pytest.mark.parametrize("name", ROUTERS)
def test_an_empty_path_means_no_goal_or_no_way(name):
    router = router_for(name)
    for belief in beliefs("omni"):
        nothing = router.route(belief, Mission(MISSION.map_from_start, ()))
        assert nothing.empty
        assert nothing.goal_in_odom is None
        assert not nothing.blocked
        assert nothing.length_m == 0.0
        route = router.route(belief, MISSION)
        assert route.empty == route.blocked
        assert route.goal_in_odom is not None


@pytest.mark.parametrize("name", ROUTERS)
def test_the_goal_is_of_the_map_and_the_route_of_odom(name):
    router, belief = router_for(name), beliefs("omni")[TICKS - 1]
    for map_from_odom in (SE2(), SE2(3.0, -2.0, 2.0)):
        moved = replace(belief, map_from_odom=map_from_odom)
        ahead = moved.odom_from_base.apply(np.array([0.8, 0.0]))
        x, y = map_from_odom.apply(ahead)
        goal = Goal(float(x), float(y))
        route = router.route(moved, Mission(MISSION.map_from_start, (goal,)))
        assert np.allclose(route.goal_in_odom, ahead, atol=1e-9)
        assert math.dist(route.path_in_odom[-1], ahead) <= goal.tolerance_m


@pytest.mark.parametrize("name", ROUTERS)
def test_the_first_goal_is_the_one_to_go_to(name):
    belief = beliefs("omni")[TICKS - 1]
    first = replace(MISSION, goals=MISSION.goals[:1])
    assert router_for(name).route(belief, MISSION).goal_in_odom == router_for(name).route(belief, first).goal_in_odom
