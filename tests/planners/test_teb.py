import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from planners.standing import Discs, standing_world
from planners.teb.band import Band, laid_along, taken_over
from planners.teb.cost_kernels import evaluated, nearest_poses
from planners.teb.graph_kernels import BANDWIDTH, Bounds, Ends, Scene, Weights
from planners.teb.homotopy import detours, in_the_way, sides, standing_discs
from planners.teb.optimiser_kernels import optimised, passing_times, resized, solve_banded, stepped
from planners.teb.planner import ElasticBand
from planners.teb.window import window_of
from tests.planners.synthetic import OMNI, Box, Disc, belief_of
from tests.planners.tracked import JACKAL, WALLS, Tracking, planner_of, route_from, run, tracks_of

NONE = Discs.of(())
BOUNDS = Bounds(0.8, 0.2, 2.0, 1.0, 2.5, 0.10, 0.35, 0.5, 0.05)
TIGHT = Bounds(0.2, 0.0, 0.3, 0.3, 0.4, 0.60, 0.90, 1.2, 0.05)  # every penalty is met
OFF = Weights(*([0.0] * 12))
ALL = Weights(1.0, 10.0, 3.0, 2.0, 1.5, 1.2, 0.7, 5.0, 0.9, 4.0, 0.8, 0.6)


def scene_of(standing=(), movers=(), via=((0.0, 0.0),)):
    world = standing_world(replace(belief_of(list(standing))))
    discs, lattice = Discs.of(tracks_of(list(movers))), world.lattice
    corner = lattice.x_m, lattice.y_m, lattice.cell_m
    return Scene(world.clearance_m, *corner, 0.333, discs.centre, discs.velocity, discs.radius_m, np.array(via, float))


def wild_band(n=7, seed=3):
    """Not smooth, going backwards in places; its yaws are far from the seam of the angle."""
    rng = np.random.default_rng(seed)
    poses = np.column_stack((np.linspace(0.0, 1.5, n) + rng.uniform(-0.3, 0.3, n), rng.uniform(-0.4, 0.4, (n, 2))))
    return poses, rng.uniform(0.2, 0.6, n - 1)


def cost_of(poses, times, scene, bounds, weights, ends, derive=False, held=None):
    held_poses, held_times = held or (poses, times)
    passed, nearest = passing_times(held_times), nearest_poses(held_poses, scene.via)
    return evaluated(poses, times, passed, nearest, scene, bounds, weights, ends, derive)


def dense(matrix):
    n = len(matrix)
    full = np.zeros((n, n))
    for k in range(min(BANDWIDTH + 1, n)):
        full[np.arange(k, n), np.arange(n - k)] = full[np.arange(n - k), np.arange(k, n)] = matrix[k:, k]
    return full


@pytest.mark.parametrize("only", [None, *Weights._fields])
def test_gradient_agrees_with_finite_differences(only):
    weights = ALL if only is None else OFF._replace(**{only: 2.0})
    scene = scene_of([Disc(0.8, 0.9, 0.3)], [Disc(1.2, -0.5, 0.2, -0.4, 0.1)], via=((0.5, 0.3), (1.0, -0.2)))
    band, ends, nudge = wild_band(), Ends(0.5, -0.3, True), 1e-6
    cost, normal = cost_of(*band, scene, TIGHT, weights, ends, True)
    assert cost > 0.0
    for i, slope in enumerate(normal.gradient):
        step = nudge * np.eye(len(normal.gradient))[i]
        ahead, back = (cost_of(*stepped(*band, e), scene, TIGHT, weights, ends, held=band)[0] for e in (step, -step))
        assert 2.0 * slope == pytest.approx((ahead - back) / (2.0 * nudge), rel=1e-4, abs=1e-5 * cost)


@pytest.mark.parametrize(
    ("only", "ends"),
    [("acceleration", Ends(0.9, 0.0, False)), ("turning", Ends(0.0, 0.3, False)), ("obstacle", Ends(0.0, 0.0, False))],
)
def test_normal_equations_of_one_penalty_are_the_square_of_its_gradient(only, ends):
    poses = np.array([[0.0, 0.0, 0.0], [0.5, 0.1, 0.2], [0.7, 0.15, 1.9]])  # brakes and turns in its second step only
    times = np.array([0.5, 0.6])
    weights = OFF._replace(**{only: 2.0})
    cost, normal = cost_of(poses, times, scene_of([Disc(0.5, 0.7, 0.2)]), BOUNDS, weights, ends, True)
    assert cost > 0.0
    assert dense(normal.matrix) == pytest.approx(np.outer(normal.gradient, normal.gradient) / cost)


def test_banded_solution_is_the_dense_one():
    rng = np.random.default_rng(1)
    full = np.tril(np.triu(rng.uniform(-1, 1, (30, 30)), -BANDWIDTH), BANDWIDTH)
    full = full + full.T + 25.0 * np.eye(30)
    matrix, right = np.zeros((30, BANDWIDTH + 1)), rng.uniform(-1, 1, 30)
    for k in range(BANDWIDTH + 1):
        matrix[k:, k] = np.diagonal(full, -k)
    definite, x = solve_banded(matrix, right)
    assert definite
    assert x == pytest.approx(np.linalg.solve(full, right))
    matrix[12, 0] = -5.0
    assert not solve_banded(matrix, right)[0]


def straight(length_m, ends, weights=None):
    weights = weights or planner_of(ElasticBand)._weights
    band = laid_along(np.array([[0.0, 0.0], [length_m, 0.0]]), 0.0, 0.0, 0.8, 2.0, 0.3)
    poses, times, _ = optimised(*(band.poses, band.times_s), scene_of(), BOUNDS, weights, ends, 0.3, 0.1, 60, 6, 8, 2.0)
    return Band(poses, times)


def test_straight_band_that_passes_through_takes_the_time_of_its_cap():
    band = straight(2.4, Ends(0.75, 0.0, False))
    assert band.duration_s == pytest.approx(2.4 / 0.8, rel=0.07)
    assert (np.diff(band.poses[:, 0]) / band.times_s).max() <= 0.8 + 0.02  # the penalty is soft
    assert np.abs(band.poses[:, 1:]).max() < 1e-6


def test_straight_band_from_rest_to_rest_takes_the_time_of_the_trapezoid():
    stiff = planner_of(ElasticBand)._weights._replace(speed=200.0, acceleration=200.0)
    band = straight(2.4, Ends(0.0, 0.0, True), stiff)
    assert band.duration_s == pytest.approx(2.4 / 0.8 + 0.8 / 1.0, rel=0.08)
    speed = np.diff(band.poses[:, 0]) / band.times_s
    middle = 0.5 * (band.times_s[1:] + band.times_s[:-1])
    assert np.abs(np.diff(speed) / middle).max() < 1.0 + 0.1


def test_band_turns_about_and_comes_back_without_moving_sideways():
    path = np.array([[0.0, 0.0], [-1.5, 0.5]])
    end_yaw = math.atan2(0.5, -1.5)
    band = laid_along(path, 0.0, end_yaw, 0.8, 2.0, 0.3)
    weights = planner_of(ElasticBand)._weights
    poses, times, _ = optimised(band.poses, band.times_s, scene_of(), BOUNDS, weights, Ends(0, 0, True), 0.3, 0.1, 60, 6, 8, 2.0)
    turn = (np.diff(poses[:, 2]) + np.pi) % (2 * np.pi) - np.pi
    middle, step = poses[:-1, 2] + 0.5 * turn, np.diff(poses[:, :2], axis=0)
    assert np.abs(np.cos(middle) * step[:, 1] - np.sin(middle) * step[:, 0]).max() < 0.01
    assert np.abs(turn / times).max() < 2.05
    assert poses[-1] == pytest.approx([-1.5, 0.5, end_yaw])


@pytest.mark.parametrize("times", [[1.4, 0.3, 0.3], [0.05, 0.05, 0.3, 0.05], [0.3, 0.3], [0.1] * 9])
def test_resizing_keeps_ends_and_time(times):
    times = np.array(times)
    poses = np.column_stack((np.linspace(0, 1, len(times) + 1), np.zeros((len(times) + 1, 2))))
    resized_poses, resized_times = poses, times
    for _ in range(6):
        resized_poses, resized_times = resized(resized_poses, resized_times, 0.3, 0.1, 3, 60)
    assert resized_times.sum() == pytest.approx(times.sum())
    assert len(resized_poses) == len(resized_times) + 1 >= 3
    assert (resized_poses[[0, -1]] == poses[[0, -1]]).all()
    if len(resized_poses) > 3:
        assert resized_times.max() <= 0.4
        assert resized_times.min() >= 0.2 - 1e-12


def test_a_band_is_taken_over_from_where_the_robot_is_to_where_the_route_goes():
    poses = np.column_stack((0.24 * np.arange(8.0), np.zeros((8, 2))))
    band = Band(poses, np.full(7, 0.3))
    pose, end = np.array([0.5, 0.02, 0.1]), np.array([1.9, 0.0, 0.0])
    on = taken_over(band, pose, end, 0.05, 0.3, 0.8)
    assert (on.poses[0] == pose).all()
    assert (on.poses[-1] == end).all()
    assert len(on.poses) == len(on.times_s) + 1 == 7  # two are passed, one is new
    assert (np.diff(on.poses[:, 0]) > 0.0).all()


def test_window_ends_where_the_look_ahead_does_or_where_the_route_does():
    route, pose = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 4.0]]), np.array([0.0, 0.1, 0.0])
    window = window_of(route, pose, 2.0)
    assert not window.stops
    assert window.path[-1] == pytest.approx([1.0, 2.0 - math.hypot(1.0, 0.1)])
    assert window.end_yaw == pytest.approx(math.pi / 2)
    assert window_of(route, pose, 9.0).stops


@pytest.mark.parametrize("velocity", [(0.0, 0.0), (0.3, 0.1)])
def test_detours_pass_an_obstacle_on_both_sides_of_where_it_is_then(velocity):
    disc = Discs.of(tracks_of([Disc(1.0 - 1.3 * velocity[0], -1.3 * velocity[1], 0.3, *velocity)]))
    band = laid_along(np.array([[0.0, 0.0], [3.0, 0.0]]), 0.0, 0.0, 0.8, 2.0, 0.3)
    met, at = in_the_way(band, disc, 0.5, 2)
    assert len(met) == 1
    ways = [laid_along(path, 0.0, 0.0, 0.8, 2.0, 0.3) for path in detours(band, met, at, 0.5)]
    assert {sides(way, met) for way in ways} == {(True,), (False,)}
    left = next(way for way in ways if sides(way, met) == (False,))
    assert left.poses[:, 1].max() > 0.5


def test_what_is_out_of_the_way_is_not_passed_on_both_sides():
    band = laid_along(np.array([[0.0, 0.0], [3.0, 0.0]]), 0.0, 0.0, 0.8, 2.0, 0.3)
    discs = Discs.of(tracks_of([Disc(1.0, 2.0, 0.3), Disc(2.0, 0.1, 0.2), Disc(0.8, -0.1, 0.2), Disc(2.5, 0.0, 0.1, 0.0, 1.0)]))
    met, _ = in_the_way(band, discs, 0.4, 5)
    assert met.centre[:, 0].tolist() == [0.8, 2.0]


def test_small_things_that_stand_are_discs_and_walls_are_not():
    discs = standing_discs(standing_world(belief_of([*WALLS, Disc(1.0, 0.3, 0.25)])))
    assert len(discs) == 1
    assert discs.centre[0] == pytest.approx([1.0, 0.3], abs=0.03)
    assert 0.25 <= discs.radius_m[0] < 0.38


def test_both_ways_round_are_tried_and_the_shorter_is_taken():
    for y in (0.12, -0.12):
        belief = belief_of([Disc(1.5, y, 0.3)])
        plan = planner_of(ElasticBand).plan(belief, route_from(belief, 3.0, 0.0))
        assert plan.diagnostics.ways >= 2
        beside = np.interp(1.5, plan.path_in_odom[:, 0], plan.path_in_odom[:, 1])
        assert beside * y < 0.0


def test_the_way_taken_is_kept_when_the_other_becomes_a_little_cheaper():
    planner = planner_of(ElasticBand)
    first, other = belief_of([Disc(1.5, 0.06, 0.3)]), belief_of([Disc(1.5, -0.02, 0.3)])
    planner.plan(first, route_from(first, 3.0, 0.0))
    kept = planner.plan(other, route_from(other, 3.0, 0.0)).path_in_odom
    anew = planner_of(ElasticBand).plan(other, route_from(other, 3.0, 0.0)).path_in_odom
    at_pillar = [np.interp(1.5, path[:, 0], path[:, 1]) for path in (kept, anew)]
    assert at_pillar[0] < 0.0 < at_pillar[1]


def test_a_band_into_an_obstacle_is_not_driven():
    belief = belief_of([Box(0.45, -2.5, 3.0, 2.5)], twist=BodyTwist(0.3, 0.0, 0.0))
    plan = planner_of(ElasticBand).plan(belief, route_from(belief, 2.0, 0.0))
    assert not plan.diagnostics.feasible
    assert plan.base == BodyTwist()


def test_drawn_seconds_are_on_the_band_a_second_apart():
    walker = Disc(2.0, 0.3, 0.3, -0.5)
    belief = belief_of([walker])
    plan = Tracking(planner_of(ElasticBand), [walker]).plan(belief, route_from(belief, 4.0, 0.0))
    drawn = {drawing.name: drawing.points_in_odom for drawing in plan.drawings}
    assert len(drawn["band"]) == plan.diagnostics.poses
    assert len(drawn["seconds"]) == math.floor(plan.diagnostics.duration_s)
    assert np.hypot(*np.diff(drawn["seconds"], axis=0).T).max() <= 0.85


@pytest.mark.parametrize("limits", [OMNI, replace(JACKAL, reverse=False)], ids=["omni", "no reverse"])
def test_it_neither_strafes_nor_reverses_where_it_may_not(limits):
    trace = run(planner_of(ElasticBand, limits), [], [], (-2.0, 0.3), limits=limits)
    assert trace.reached(-2.0, 0.3)
    assert {plan.base.vy for plan in trace.plans} == {0.0}
    assert limits.reverse or min(plan.base.vx for plan in trace.plans) >= 0.0


def test_a_robot_without_a_base_is_refused():
    with pytest.raises(ConfigurationError, match=r"planner.name 'teb'"):
        planner_of(ElasticBand, None)
