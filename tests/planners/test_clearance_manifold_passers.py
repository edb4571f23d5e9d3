"""Who walks up and down the way, and who comes from behind: the line that is kept off, and looking round."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.geometry import SE2
from estimators.belief import Track
from planners.clearance_manifold.glance import Glance
from planners.clearance_manifold.passers import LOOKS, Passers
from planners.clearance_manifold.ridge_kernels import Demand, Ground, Sections, ample_boxes, boxes, walls
from planners.clearance_manifold.settings import GlanceSettings, PasserSettings
from tests.planners.synthetic import Box, belief_of

WALLS = (Box(-3, 1.2, 3, 1.4), Box(-3, -1.4, 3, -1.2))  # a corridor of 2.4 m
AT, NORMAL = np.array([[0.0, 0.0], [1.5, 0.0]]), np.tile([0.0, 1.0], (2, 1))
PERIOD_S, HALF_M = 0.05, 0.25
OPEN = belief_of([])


def ground_of(belief):
    at = belief.clearance.lattice
    return Ground(belief.clearance.clearance_m, at.x_m, at.y_m, at.cell_m)


def walked(looks, lane_m=0.3, speed=0.8, **settings):
    """Somebody goes along y = lane, seen with 4 cm of noise; then one second passes in which nobody is seen."""
    rng, passers = np.random.default_rng(1), Passers(PasserSettings(**settings))
    for k in range(looks):
        place = np.array([-2.0 + speed * PERIOD_S * k, lane_m]) + rng.normal(0.0, 0.04, 2)
        track = Track(7, tuple(place), (speed, 0.0), HALF_M, np.eye(4))
        passers.update(replace(OPEN, stamp_ns=round(PERIOD_S * k * 1e9), tracks=(track,)))
    passers.update(replace(OPEN, stamp_ns=round((PERIOD_S * looks + 1.0) * 1e9)))
    return passers


@pytest.mark.parametrize("lane_m", [0.3, -0.5])
def test_the_line_that_somebody_walked_is_known_beyond_where_he_was_seen(lane_m):
    taken = walked(40, lane_m).across(AT, NORMAL, ground_of(OPEN))
    assert taken[:, 0] == pytest.approx(np.tile([lane_m - HALF_M, lane_m + HALF_M], (2, 1)), abs=0.06)


@pytest.mark.parametrize(
    ("looks", "speed", "settings"),
    [(LOOKS - 1, 2.0, {}), (40, 0.2, {}), (40, 0.8, {"least_m": 2.0}), (40, 0.8, {"remember_s": 0.5})],
    ids=["noise", "stands", "hardly moved", "forgotten"],
)
def test_who_was_hardly_seen_to_walk_or_long_ago_leaves_no_line(looks, speed, settings):
    assert np.isnan(walked(looks, speed=speed, **settings).across(AT, NORMAL, ground_of(OPEN))).all()


def test_who_crosses_the_way_or_walks_far_beside_it_takes_nothing_up():
    passers = walked(40)
    assert np.isnan(passers.across(AT, np.tile([1.0, 0.0], (2, 1)), ground_of(OPEN))).all()
    assert np.isnan(passers.across(AT + np.array([0.0, 2.0]), NORMAL, ground_of(OPEN))).all()


def test_where_nobody_was_seen_people_are_expected_in_the_middle_of_corridors_only():
    passers, shifted = Passers(PasserSettings(middle=True)), AT + np.array([0.0, 0.3])
    taken = passers.across(shifted, NORMAL, ground_of(belief_of(WALLS)))
    assert taken[:, -1] == pytest.approx(np.tile([-0.3 - HALF_M, -0.3 + HALF_M], (2, 1)), abs=0.06)
    assert np.isnan(passers.across(AT, NORMAL, ground_of(OPEN))).all()
    assert walls(ground_of(belief_of(WALLS)), shifted, NORMAL, 3.0) == pytest.approx(np.tile([1.5, 0.9], (2, 1)), abs=0.06)
    assert np.isinf(walls(ground_of(belief_of(WALLS)), AT, NORMAL, 1.0)).all()


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_ridge_lies_half_way_between_the_wall_and_who_walks_in_the_middle(side):
    """rho = 1.2 - |y|, to him |y| - 0.25: both 0.475 at 0.725; the part with half of what that has beyond rho_min is kept to."""
    ground, demand = ground_of(belief_of(WALLS)), Demand(0.2, 0.27, 0.42, 0.6, 0.0)
    lines = np.tile([-HALF_M, HALF_M], (2, 1, 1))
    sections = Sections(AT, NORMAL, np.tile([-1.1, 1.1], (2, 1)), lines)
    found = boxes(ground, sections, np.full(2, 0.6 * side), 0.01, demand)
    assert found[:, 2] == pytest.approx(0.725 * side, abs=0.04)
    assert found[:, :2] == pytest.approx(np.tile([-1.0, 1.0], (2, 1)), abs=0.05)  # it may still cross him
    kept = np.abs(ample_boxes(ground, sections, found, 0.01, demand))
    level = 0.5 * (0.2 + 0.475)
    assert np.sort(kept, axis=1) == pytest.approx(np.tile([HALF_M + level, 1.2 - level], (2, 1)), abs=0.05)


def looked_round(obstacles, seconds, *, enters=False, **settings):
    """Return how far round a robot turned to look, to either side, that else looks along x."""
    belief, glance, yaw, yaws = belief_of(obstacles), Glance(GlanceSettings(**settings), math.radians(87.0)), 0.0, []
    for _ in range(round(seconds / PERIOD_S)):
        glance.see(yaw, PERIOD_S)
        wanted = glance.direction(SE2(0.0, 0.0, yaw), belief.clearance, allowed=True, enters=enters) or 0.0
        yaw += min(max(math.remainder(wanted - yaw, math.tau), -0.06), 0.06)
        yaws.append(yaw)
    return np.array(yaws)


@pytest.mark.parametrize(("enters", "every_s"), [(False, 8.0), (True, 2.5)])
def test_it_looks_behind_itself_every_few_seconds_and_on_again(enters, every_s):
    yaws = looked_round(WALLS, every_s + 6.5, enters=enters, enabled=True)
    turned = np.abs(yaws) > 0.1
    first = np.argmax(turned) * PERIOD_S
    assert first == pytest.approx(every_s, abs=0.15)
    farthest = math.pi + math.radians(22.5)  # of the directions into which it is 2 m to the walls, the last to be seen
    assert np.abs(yaws).max() == pytest.approx(farthest - math.radians(0.5 * 87.0 - 10.0), abs=0.1)  # no farther than it takes
    assert not turned[-1]


@pytest.mark.parametrize(("obstacles", "enabled"), [(WALLS, False), ((*WALLS, Box(-1.2, -1.2, -1.0, 1.2)), True)])
def test_it_does_not_look_round_where_a_wall_follows_or_when_it_is_off(obstacles, enabled):
    assert np.abs(looked_round(obstacles, 10.0, enabled=enabled)).max() < 1e-9


def test_how_far_beside_a_line_points_are_and_whereto():
    passers = walked(60, 0.0)
    room = passers.aside(np.array([[0.0, 0.6], [0.5, -0.1], [9.0, 0.0]]))
    assert room[:, 0] == pytest.approx([0.35, -0.15, np.inf], abs=0.05)
    assert room[:2, 1:] == pytest.approx(np.array([[0.0, 1.0], [0.0, -1.0]]), abs=0.05)


@pytest.mark.parametrize(
    ("at_m", "until_s", "comes"),
    [(1.2, 1.0, True), (2.5, 1.0, False), (2.5, 3.0, True), (-2.0, 3.0, False)],
    ids=["near", "not yet", "by then", "past"],
)
def test_who_was_seen_lately_is_expected_where_he_goes(at_m, until_s, comes):
    """After 40 looks at 0.8 m/s from -2 m on, and a second unseen, he is at 0.4 m; apart_m is 0.9 m."""
    assert walked(40, 0.0).comes(np.array([[at_m, 0.0]]), until_s) == comes
    assert not walked(40, 0.0, expect_s=0.5).comes(np.array([[at_m, 0.0]]), until_s)


def test_the_noise_of_a_corridors_wall_does_not_stand_for_who_is_expected_in_its_middle():
    taken = walked(40, 1.1, middle=True).across(AT, NORMAL, ground_of(belief_of(WALLS)))
    assert taken[:, -1] == pytest.approx(np.tile([-HALF_M, HALF_M], (2, 1)), abs=0.06)
    assert np.isnan(walked(40, 0.3, middle=True).across(AT, NORMAL, ground_of(belief_of(WALLS)))[:, -1]).all()
