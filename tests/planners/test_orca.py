import math

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from planners.orca.half_plane_kernels import agent_half_planes, standing_half_planes
from planners.orca.nonholonomic import followable, followed, tracking_error_m
from planners.orca.planner import ReciprocalAvoidance
from planners.orca.program_kernels import choose_velocity, least_violation, nearest_inside
from planners.shields.plane_qp import solve
from planners.standing import boundary_points, standing_world
from tests.planners.synthetic import OMNI, Box, Disc, belief_of
from tests.planners.tracked import JACKAL, WALLS, Tracking, planner_of, route_from, run

BOX = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]), np.full(4, -1.0)  # |v| <= 1 along each axis


def half_planes_of_one(offset, velocity, radius_m, own, share=1.0, horizon_s=2.0):
    arguments = (np.array([offset], float), np.array([velocity], float), np.array([radius_m]), np.array(own, float))
    normals, bounds = agent_half_planes(*arguments, share, horizon_s, 0.05)
    return normals[0], bounds[0]


def time_to_touch(offset, relative, radius_m):
    """When two discs first touch; infinite when they never do."""
    p, v = np.array(offset, float), -np.array(relative, float)
    a, b, c = v @ v, 2.0 * p @ v, p @ p - radius_m**2
    root = b * b - 4.0 * a * c
    if a == 0.0 or root < 0.0 or b >= 0.0:
        return math.inf
    return (-b - math.sqrt(root)) / (2.0 * a)


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_head_on_the_way_out_is_across_the_leg_of_the_cone(share):
    """p along x, R = |p| sin(alpha): the leg is alpha from the x axis, and v on the axis is v sin(alpha) from it."""
    normal, bound = half_planes_of_one((5.0, 0.0), (-0.5, 0.0), 1.0, (0.5, 0.0), share, horizon_s=20.0)
    alpha = math.asin(1.0 / 5.0)
    assert np.abs(normal) == pytest.approx([math.sin(alpha), math.cos(alpha)])
    assert normal[0] < 0.0
    assert bound == pytest.approx(normal[0] * 0.5 + share * 1.0 * math.sin(alpha))


def test_with_a_short_horizon_the_way_out_is_to_slow_down():
    normal, bound = half_planes_of_one((5.0, 0.0), (0.0, 0.0), 1.0, (1.9, 0.0), horizon_s=2.0)
    assert normal == pytest.approx([-1.0, 0.0])
    assert -bound == pytest.approx((5.0 - 1.0) / 2.0)


def test_every_velocity_on_an_edge_touches_at_the_horizon_or_not_before():
    rng = np.random.default_rng(7)
    for _ in range(200):
        offset, velocity, own = rng.uniform(-4, 4, 2), rng.uniform(-1, 1, 2), rng.uniform(-1, 1, 2)
        radius = 0.9 * min(math.hypot(*offset), 1.0)
        normal, bound = half_planes_of_one(offset, velocity, radius, own, horizon_s=3.0)
        out = own + (bound - normal @ own + 1e-9) * normal  # the nearest permitted velocity
        assert time_to_touch(offset, out - velocity, radius * (1.0 - 1e-9)) >= 3.0 - 1e-6
        for along in rng.uniform(-2, 2, 5):  # the obstacle is convex
            other = out + along * np.array([-normal[1], normal[0]]) + rng.uniform(0, 1) * normal
            assert time_to_touch(offset, other - velocity, radius * (1.0 - 1e-9)) >= 3.0 - 1e-6


def test_two_that_share_equally_part_without_touching():
    """The paper's guarantee: each takes half of the way out, and both together are clear for the whole horizon."""
    one, other = np.array([0.5, 0.0]), np.array([-0.5, 0.02])
    normal, bound = half_planes_of_one((3.0, 0.1), other, 0.8, one, 0.5, 10.0)
    counter, limit = half_planes_of_one((-3.0, -0.1), one, 0.8, other, 0.5, 10.0)
    after, after_other = one + (bound - normal @ one) * normal, other + (limit - counter @ other) * counter
    assert time_to_touch((3.0, 0.1), after - after_other, 0.8 - 1e-9) >= 10.0
    assert time_to_touch((3.0, 0.1), one - other, 0.8) < 10.0


def test_overlapping_agents_part_within_one_period():
    normal, bound = half_planes_of_one((0.4, 0.0), (0.0, 0.0), 0.5, (0.0, 0.0))
    assert normal == pytest.approx([-1.0, 0.0])
    assert bound == pytest.approx(0.1 / 0.05)


def test_standing_still_keeps_every_static_half_plane():
    offset = np.random.default_rng(1).uniform(-2, 2, (50, 2))
    _, bounds = standing_half_planes(offset, 0.5, 1.5)
    assert (bounds <= 0.0).all()
    normals, bounds = standing_half_planes(np.array([[2.0, 0.0]]), 0.5, 1.5)
    assert (-bounds[0], normals[0, 0]) == pytest.approx((1.0, -1.0))


def draw(rng, count):
    angle = rng.uniform(-math.pi, math.pi, count)
    normals = np.concatenate((BOX[0], np.stack((np.cos(angle), np.sin(angle)), axis=1)))
    return normals, np.concatenate((BOX[1], rng.uniform(-0.9, 0.25, count))), rng.uniform(-1.5, 1.5, 2)


def test_program_agrees_with_the_exact_polygon():
    """An independent method: clip the box half-plane by half-plane, take the nearest point of what is left."""
    rng, feasible = np.random.default_rng(3), 0
    for _ in range(300):
        normals, bounds, wanted = draw(rng, rng.integers(1, 9))
        expected, slack = solve(normals[4:], bounds[4:], wanted, np.full(2, -1.0), np.full(2, 1.0))
        velocity, violation = choose_velocity(normals, bounds, 4, wanted)
        assert violation == pytest.approx(slack, abs=3e-6)
        if slack == 0.0:
            feasible += 1
            assert velocity == pytest.approx(expected, abs=1e-6)
        assert (normals[:4] @ velocity >= bounds[:4] - 1e-6).all()
        assert (bounds[4:] - normals[4:] @ velocity).max() <= violation + 1e-6
    assert 100 < feasible < 290


def test_program_agrees_with_brute_force():
    rng = np.random.default_rng(5)
    lattice = np.stack(np.meshgrid(*[np.linspace(-1, 1, 401)] * 2), axis=-1).reshape(-1, 2)
    for _ in range(20):
        normals, bounds, wanted = draw(rng, 6)
        worst = (bounds[4:, None] - normals[4:] @ lattice.T).max(axis=0)
        velocity, violation = choose_velocity(normals, bounds, 4, wanted)
        if worst.min() <= 0.0:
            least = np.hypot(*(lattice[worst <= 0.0] - wanted).T).min()
            assert math.hypot(*(velocity - wanted)) <= least + 1e-9
        else:
            assert violation == pytest.approx(worst.min(), abs=0.01)
            assert violation <= worst.min() + 1e-9


def test_first_half_plane_that_leaves_nothing_is_named():
    normals, bounds = np.array([[1.0, 0.0], [-1.0, 0.0]]), np.array([0.5, 0.5])
    met, point = nearest_inside(normals, bounds, np.zeros(2))
    assert met == 1
    assert point == pytest.approx([0.5, 0.0])


def test_opposite_demands_are_violated_alike_inside_the_hard_ones():
    normals = np.concatenate((BOX[0], [[1.0, 0.0], [-1.0, 0.0]]))
    bounds = np.concatenate((BOX[1], [0.6, 0.2]))
    point, violation = least_violation(normals, bounds, 4, np.zeros(2))
    assert violation == pytest.approx(0.4)
    assert point[0] == pytest.approx(0.2)


@pytest.mark.parametrize("angle", [0.2, -0.6, 1.2, math.pi / 2])
def test_tracking_error_is_the_distance_to_the_holonomic_robot_at_the_arcs_end(angle):
    speed, turn_s, rate = 0.7, 0.35, 2.0
    forward, wz = followed(speed * np.array([math.cos(angle), math.sin(angle)]), turn_s, rate)
    time_s = max(turn_s, abs(angle) / rate)
    assert wz * time_s == pytest.approx(angle)
    radius = forward / wz
    end = radius * np.array([math.sin(angle), 1.0 - math.cos(angle)])
    holonomic = speed * time_s * np.array([math.cos(angle), math.sin(angle)])
    assert math.hypot(*(end - holonomic)) == pytest.approx(tracking_error_m(speed, angle, turn_s, rate))
    for other in (0.97 * radius, 1.03 * radius):  # no other speed on the arc ends nearer
        assert math.hypot(*(other / radius * end - holonomic)) > tracking_error_m(speed, angle, turn_s, rate)


def test_polygon_of_followable_velocities_lies_inside_the_papers_set_and_fills_most_of_it():
    normals, bounds = followable(0.1, 0.35, 2.0, 0.8)
    points = np.random.default_rng(0).uniform([0.0, -1.0], [0.8, 1.0], (20_000, 2))
    inside = (points @ normals.T >= bounds).all(axis=1)
    error = np.array([tracking_error_m(math.hypot(x, y), math.atan2(y, x), 0.35, 2.0) for x, y in points])
    assert error[inside].max() <= 0.1
    assert inside.sum() > 0.95 * (error <= 0.1).sum()


@pytest.mark.parametrize("limits", [JACKAL, OMNI], ids=["jackal", "omni"])
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
def test_it_arrives_without_touching(standing, movers, goal, limits):
    trace = run(planner_of(ReciprocalAvoidance, limits), standing, movers, goal, limits=limits)
    assert trace.reached(*goal)
    assert trace.min_clearance_m > 0.05


def test_a_track_is_avoided_earlier_than_the_same_walker_in_the_grid_alone():
    walker = Disc(2.5, -2.2, 0.25, 0.0, 0.8)
    seen = run(planner_of(ReciprocalAvoidance), [], [walker], (4.5, 0.0))
    unseen = run(planner_of(ReciprocalAvoidance), [walker], [], (4.5, 0.0))
    assert seen.min_clearance_m > unseen.min_clearance_m


def test_agents_that_leave_nothing_are_granted_the_least_violation():
    around = [Disc(0.7 * math.cos(a), 0.7 * math.sin(a), 0.25, -math.cos(a), -math.sin(a)) for a in np.linspace(0, 6, 9)]
    belief = belief_of(around)
    plan = Tracking(planner_of(ReciprocalAvoidance), around).plan(belief, route_from(belief, 4.0, 0.0))
    assert plan.diagnostics.violation_m_s > 0.0
    assert plan.base.finite


def test_drawn_edges_are_those_of_the_half_planes():
    walker = Disc(2.0, 0.0, 0.3, -0.5)
    belief = belief_of([walker], twist=BodyTwist(0.5, 0.0, 0.0))
    plan = Tracking(planner_of(ReciprocalAvoidance), [walker]).plan(belief, route_from(belief, 4.0, 0.0))
    drawn = {drawing.name: drawing.points_in_odom for drawing in plan.drawings}
    radius = 0.3 + 0.333 + 0.05 + 0.10
    normal, bound = half_planes_of_one((2.0, 0.0), (-0.5, 0.0), radius, (0.5, 0.0), 1.0, 3.0)
    assert drawn["half-plane 0"] @ normal == pytest.approx([bound, bound])
    assert (drawn["permitted velocities"] @ normal >= bound - 1e-5).all()


def test_a_robot_without_a_base_is_refused():
    with pytest.raises(ConfigurationError, match=r"planner.name 'orca'"):
        planner_of(ReciprocalAvoidance, None)


def test_tracks_are_taken_out_of_what_stands():
    wall, walker = Box(1.5, -2.0, 1.7, 2.0), Disc(0.0, 1.5, 0.3, vx=0.5)
    belief = belief_of([wall, walker])
    seen = []
    Tracking(type("Spy", (), {"plan": lambda _, b, __: seen.append(b)})(), [walker]).plan(belief, None)
    world = standing_world(seen[0])
    clearance = world.clearance_at(np.array([[0.0, 1.5], [1.3, 0.0], [1.6, 0.0]]))
    assert clearance[0] == pytest.approx(1.5, abs=0.05)  # to the wall, through where the walker is
    assert clearance[1] == pytest.approx(0.2, abs=0.06)
    assert clearance[2] < 0.0
    points = boundary_points(world, np.zeros((1, 2)), 2.0, 0.2, 100)
    assert math.hypot(*points[0]) == pytest.approx(1.52, abs=0.03)
    assert np.abs(points[:, 0] - 1.525).max() < 0.01  # the near face only, as far as 2 m
    apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1)) + np.eye(len(points))
    assert apart.min() >= 0.2
