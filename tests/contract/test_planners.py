"""Every planner, on every kind of base: what it asks for can be driven, and it knows when to stand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from planners.planner import PlannerSetup, no_path
from planners.router import Route
from runtime.limits import Limiter
from runtime.registry import Part, load, names
from tests.contract.facts import all_finite
from tests.contract.streams import BASES, PERIOD_S, RADIUS_M, beliefs, routes, stream

PLANNERS = names(Part.PLANNER)


def planner_for(name: str, base: str | None):
    """Build it; a planner may refuse a base that it cannot drive, in one sentence that names it."""
    cls, limits = load(Part.PLANNER, name), stream(base).limits if base else None
    try:
        return cls(cls.Settings(), PlannerSetup(PERIOD_S, RADIUS_M, limits, seed=3))
    except ConfigurationError as error:
        sentence = str(error)
    assert f"'{name}'" in sentence
    assert "\n" not in sentence
    return pytest.skip(sentence)


@pytest.mark.parametrize("base", [*BASES, None])
@pytest.mark.parametrize("name", PLANNERS)
def test_asks_for_what_is_finite_and_inside_the_caps(name, base):
    planner, source = planner_for(name, base), base or "omni"
    limits = stream(source).limits
    for belief, route in zip(beliefs(source), routes(source), strict=True):
        plan = planner.plan(belief, route)
        assert plan.base is None or (base and plan.base.finite and Limiter(limits, PERIOD_S).within_caps(plan.base))
        assert plan.arm is None or all_finite(plan.arm)
        assert plan.path_in_odom.ndim == 2
        assert plan.path_in_odom.shape[1] == 2
        assert all_finite(plan.path_in_odom)
        assert plan.latency_ns >= 0


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("name", PLANNERS)
@pytest.mark.parametrize("blocked", [False, True])
def test_stands_without_a_route(name, base, blocked):
    planner = planner_for(name, base)
    goal = (5.0, 0.0) if blocked else None
    for index, belief in enumerate(beliefs(base)):
        if index % 3 == 0:
            planner.plan(belief, routes(base)[index])  # it was on its way
        asked = planner.plan(belief, Route(goal, no_path(), 0.0, blocked)).base or BodyTwist()
        assert (asked.vx, asked.vy) == (0.0, 0.0)
        assert blocked or asked.wz == 0.0  # while its way is blocked it may turn, to look whether it still is


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("name", PLANNERS)
def test_where_odom_lies_in_the_map_does_not_matter(name, base):
    """Belief and route are in odom: a correction of the map must not make the robot jerk."""
    here, there = planner_for(name, base), planner_for(name, base)
    for belief, route in zip(beliefs(base), routes(base), strict=True):
        turned = replace(belief, map_from_odom=replace(belief.map_from_odom, x=7.0, yaw=math.pi / 3))
        assert here.plan(belief, route).base == there.plan(turned, route).base


@pytest.mark.parametrize("name", PLANNERS)
def test_names_a_shield_that_exists(name):
    assert load(Part.PLANNER, name).default_shield in names(Part.SHIELD)


def test_some_planner_drives_each_base():
    """Or the tests above would hold of planners that only stand."""
    for base in BASES:
        asked = []
        for name in PLANNERS:
            cls = load(Part.PLANNER, name)
            try:
                planner = cls(cls.Settings(), PlannerSetup(PERIOD_S, RADIUS_M, stream(base).limits, seed=3))
            except ConfigurationError:
                continue
            asked += [planner.plan(*pair).base for pair in zip(beliefs(base)[20:40], routes(base)[20:40], strict=True)]
        assert np.max([twist.speed_m_s for twist in asked if twist is not None]) > 0.2
