"""What orca, mpc_cbf and teb have in common: they are told of tracks, which the contract suite's beliefs have none of."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.samples import frozen_array
from planners.mpc_cbf.planner import BarrierMpc
from planners.orca.planner import ReciprocalAvoidance
from planners.router import Route
from planners.teb.planner import ElasticBand
from tests.contract.facts import all_finite, arrays, facts, forget_kernels, signatures
from tests.planners.synthetic import Box, Disc, belief_of, mission_to
from tests.planners.tracked import WALLS, planner_of, route_from, run, straight_router, tracks_of

COMPARATORS = pytest.mark.parametrize("kind", [BarrierMpc, ReciprocalAvoidance, ElasticBand])
WALKERS = [Disc(3.5, 0.3, 0.25, -0.6, 0.0), Disc(2.6, -1.2, 0.25, 0.0, 0.7), Disc(0.0, 1.0, 0.25, 0.5, 0.0)]


def scene(tick):
    """A walled corridor with a pillar and three walkers; all arrays are read-only, as those of the estimator."""
    walkers = [walker.at(0.05 * tick) for walker in WALKERS]
    standing = [Box(-2, -1.8, 9, -1.7), Box(-2, 1.7, 9, 1.8), Disc(3.2, -0.6, 0.3)]
    belief = belief_of([*standing, *walkers], SE2(0.02 * tick, 0.0, 0.1), BodyTwist(0.4, 0.0, 0.1), tick=tick)
    belief = replace(belief, tracks=tracks_of(walkers))
    for array in arrays(belief):
        frozen_array(array)
    return belief, straight_router().route(belief, mission_to(6.0, 0.0))


@COMPARATORS
def test_a_restored_one_goes_on_identically_among_tracks(kind):
    first, second = planner_of(kind), planner_of(kind)
    for tick in range(6):
        first.plan(*scene(tick))
    second.plan(*scene(30))  # a past of its own
    second.restore(first.snapshot())
    for tick in range(6, 12):
        assert facts(second.plan(*scene(tick))) == facts(first.plan(*scene(tick)))


@COMPARATORS
def test_nothing_is_compiled_for_tracks_after_warm_up(kind):
    inputs, planner = [scene(tick) for tick in range(3)], planner_of(kind)
    forget_kernels()
    planner.warm_up()
    ready = signatures()
    for belief, route in inputs:
        planner.plan(belief, route)
    assert signatures() - ready == set()


@COMPARATORS
@pytest.mark.parametrize(
    "walker", [Disc(0.0, 0.0, 0.3), Disc(0.2, 0.1, 0.3, -0.5, 0.0), Disc(40.0, 0.0, 0.3)], ids=["centred", "overlapping", "far"]
)
def test_a_track_on_the_robot_or_outside_of_the_grid_gives_a_finite_command(kind, walker):
    belief = replace(belief_of([]), tracks=tracks_of([walker]))
    plan = planner_of(kind).plan(belief, straight_router().route(belief, mission_to(4.0, 0.0)))
    assert plan.base.finite
    assert all_finite(plan.drawings)
    assert plan.base.speed_m_s <= 0.8 + 1e-9


@COMPARATORS
def test_a_route_of_one_point_or_of_the_same_point_twice_is_followed(kind):
    for path in ([[2.0, 0.0]], [[0.0, 0.0], [0.0, 0.0], [2.0, 0.0], [2.0, 0.0]]):
        plan = planner_of(kind).plan(belief_of([]), Route((2.0, 0.0), np.array(path), 2.0))
        assert plan.base.vx > 0.0
        assert plan.base.wz == pytest.approx(0.0, abs=1e-6)


@COMPARATORS
def test_the_same_world_turned_gives_the_same_command(kind):
    """A command is in the body frame: where the axes of odom point must not matter, but for the cells of the grid."""
    walkers = [Disc(2.5, 0.4, 0.25, -0.4, 0.1)]
    asked = []
    for yaw in (0.0, math.pi / 2):
        c, s = math.cos(yaw), math.sin(yaw)
        turned = [Disc(c * w.x - s * w.y, s * w.x + c * w.y, w.radius, c * w.vx - s * w.vy, s * w.vx + c * w.vy) for w in walkers]
        belief = replace(belief_of(turned, SE2(0.0, 0.0, yaw), BodyTwist(0.5, 0.0, 0.0)), tracks=tracks_of(turned))
        plan = planner_of(kind).plan(belief, straight_router().route(belief, mission_to(4.0 * c, 4.0 * s)))
        asked.append([plan.base.vx, plan.base.wz])
    assert asked[0] == pytest.approx(asked[1], abs=0.05)


@COMPARATORS
def test_inside_an_obstacle_it_stands_and_says_so(kind):
    belief = belief_of([Disc(0.0, 0.0, 0.5)])
    plan = planner_of(kind).plan(belief, route_from(belief, 4.0, 0.0))
    assert plan.base == BodyTwist()
    assert plan.diagnostics.enclosed


@COMPARATORS
def test_without_a_route_it_stands(kind):
    plan = planner_of(kind).plan(belief_of([]), Route(None, np.zeros((0, 2)), 0.0))
    assert plan.base == BodyTwist()


@pytest.mark.parametrize(("kind", "within_m_s"), [(BarrierMpc, 0.05), (ElasticBand, 0.06)])
@pytest.mark.parametrize(
    ("standing", "movers", "goal"),
    [
        ([], [], (3.0, 0.0)),
        ([], [], (-2.0, 0.5)),
        ([Disc(1.7, 0.05, 0.3)], [], (3.5, 0.0)),
        ([Box(1.5, -3, 1.7, -0.6), Box(1.5, 0.6, 1.7, 3)], [], (3.0, 0.0)),
        (WALLS, [Disc(5.0, 0.1, 0.25, -0.6)], (5.0, 0.0)),
        ([], [Disc(2.5, -2.2, 0.25, 0.0, 0.8)], (4.5, 0.0)),
    ],
    ids=["open", "behind", "pillar", "gap", "head-on", "crossing"],
)
def test_it_arrives_without_touching(kind, within_m_s, standing, movers, goal):
    trace = run(planner_of(kind), standing, movers, goal)
    assert trace.reached(*goal)
    assert trace.min_clearance_m > 0.05
    assert max(twist.speed_m_s for twist in trace.twists) == pytest.approx(0.8, abs=within_m_s)
