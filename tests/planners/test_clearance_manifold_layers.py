"""The parts of the clearance-manifold planner against closed forms and dense references."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from estimators.clearance import distance_to
from estimators.field_query import sample
from planners.clearance_manifold.branch_kernels import NARROW, STEEP, cheapest_branch, station_costs
from planners.clearance_manifold.chart import STEP_M, lay_chart
from planners.clearance_manifold.control_kernels import brakable, known_length
from planners.clearance_manifold.distance_kernels import lowered
from planners.clearance_manifold.manifold import Stations
from planners.clearance_manifold.offset_qp import OffsetProgram
from planners.clearance_manifold.prediction import ArrivalField
from planners.clearance_manifold.ridge_kernels import Demand, Ground, Sections, ample_boxes, boxes
from planners.clearance_manifold.settings import ChartSettings, PredictionSettings, SolverSettings
from tests.planners.synthetic import Box, Disc, belief_of

DEMAND = Demand(least_m=0.2, kept_m=0.2, ample_m=0.35, enough_m=5.0, centring=0.0)


def ground_of(belief):
    at = belief.clearance.lattice
    return Ground(belief.clearance.clearance_m, at.x_m, at.y_m, at.cell_m)


def straight_sections(xs, half_width_m=1.0):
    n = len(xs)
    at = np.stack((np.array(xs), np.zeros(n)), axis=1)
    return Sections(at, np.tile([0.0, 1.0], (n, 1)), np.tile([-half_width_m, half_width_m], (n, 1)))


@pytest.mark.parametrize(("left_m", "right_m"), [(0.8, 0.5), (0.4, 0.9), (0.6, 0.6)])
def test_box_and_ridge_of_a_straight_corridor_are_the_closed_form(left_m, right_m):
    """Proposition 1: between walls at -right and left, rho = min(left - y, right + y)."""
    belief = belief_of([Box(-3, left_m, 3, left_m + 1), Box(-3, -right_m - 1, 3, -right_m)])
    found = boxes(ground_of(belief), straight_sections([0.3, 1.0]), np.zeros(2), 0.02, DEMAND)
    expected = (-right_m + 0.2, left_m - 0.2, 0.5 * (left_m - right_m))
    assert found == pytest.approx(np.tile(expected, (2, 1)), abs=0.03)  # half a cell, and the scan's step


@pytest.mark.parametrize(("half_m", "kept_m"), [(0.9, 0.55), (0.6, 0.25), (0.3, 0.05)])
def test_the_ample_part_of_a_box_keeps_full_speed_or_half_of_what_there_is(half_m, kept_m):
    """Between walls at +-half: rho = half - |y|, and 0.35 m are kept, or half way from 0.2 m to half."""
    belief = belief_of([Box(-3, half_m, 3, 2), Box(-3, -2, 3, -half_m)])
    ground, sections = ground_of(belief), straight_sections([0.3, 1.0])
    found = boxes(ground, sections, np.zeros(2), 0.02, DEMAND)
    assert ample_boxes(ground, sections, found, 0.02, DEMAND) == pytest.approx(np.tile((-kept_m, kept_m), (2, 1)), abs=0.03)


def test_where_the_shield_would_stop_the_robot_a_station_costs_most_and_less_the_wider_it_is():
    demand = DEMAND._replace(kept_m=0.27, ample_m=0.42, enough_m=0.6)
    rho = np.array([[0.25, 0.27, 0.30, 0.42, 0.60]])
    cost = station_costs(rho, np.full((1, 5), np.inf), np.zeros(5), demand)[0]
    assert (np.diff(cost) < 0.0).all()
    assert cost[2] - cost[3] == pytest.approx(0.12 + NARROW * 0.12 / 0.15)
    assert cost[3] - cost[4] == pytest.approx(0.18)


def test_inside_the_box_is_safe_and_outside_is_not():
    """Proposition 1, both directions, in a corridor that narrows."""
    belief = belief_of([Disc(1.0, 1.2, 0.6), Disc(1.4, -1.1, 0.5), Box(-3, 0.9, 3, 2), Box(-3, -2, 3, -0.9)])
    ground, sections = ground_of(belief), straight_sections(np.linspace(0.0, 2.0, 9), 0.85)
    found = boxes(ground, sections, np.full(9, -0.05), 0.02, DEMAND)
    assert np.isfinite(found).all()
    rng = np.random.default_rng(0)
    for (low, high, _), x in zip(found, sections.at[:, 0], strict=True):
        for y in rng.uniform(-0.85, 0.85, 40):
            true = min(np.hypot(x - 1.0, y - 1.2) - 0.6, np.hypot(x - 1.4, y + 1.1) - 0.5, 0.9 - y, 0.9 + y)
            if low + 0.03 < y < high - 0.03:
                assert true >= 0.2 - 0.03
            elif y < low - 0.03 or y > high + 0.03:
                assert true <= 0.2 + 0.03


def test_the_quadratic_program_is_solved_as_a_dense_one():
    settings = SolverSettings()
    stations = Stations.of(settings)
    n = len(stations.arcs_m)
    assert (n, stations.own) == (21, 6)
    program = OffsetProgram(stations.arcs_m, (0.1, 0.2), 0.5, 0.5)
    rng = np.random.default_rng(1)
    for _ in range(20):
        references = (rng.uniform(-1, 1, n), rng.uniform(-1, 1, n))
        middle, half = rng.uniform(-0.6, 0.6, n), rng.uniform(0.02, 0.5, n)
        y, duals, converged = program.solve(references, middle - half, middle + half, middle, np.zeros(n))
        factor = np.linalg.cholesky(program.quadratic).T
        target = -np.linalg.solve(factor.T, program.linear(references))
        dense = lsq_linear(factor, target, (middle - half, middle + half), tol=1e-12)
        assert converged
        assert y == pytest.approx(dense.x, abs=2e-3)
        assert ((y >= middle - half) & (y <= middle + half)).all()
        again = program.solve(references, middle - half, middle + half, y, duals)[0]
        assert again == pytest.approx(y, abs=1e-3)


def test_a_solve_remembers_nothing_of_those_before():
    n = 21
    rng = np.random.default_rng(2)
    fresh = [OffsetProgram(np.linspace(0, 5, n), (0.1,), 0.5, 0.5) for _ in range(2)]
    for _ in range(5):
        bound = rng.uniform(0.1, 0.5, n)
        fresh[0].solve((rng.uniform(-1, 1, n),), -bound, bound, np.zeros(n), rng.uniform(-1, 1, n))
    last = ((rng.uniform(-1, 1, n),), np.full(n, -0.3), np.full(n, 0.3), np.zeros(n), np.zeros(n))
    one, other = (program.solve(*last) for program in fresh)
    assert one[0].tobytes() == other[0].tobytes()
    assert one[1].tobytes() == other[1].tobytes()


def test_an_approaching_wall_is_predicted_where_the_closed_form_has_it():
    """A wall at 2 m comes with 0.3 m/s; on arrival it is nearer by h c_pred 0.3, h = x / 0.4, c_pred = 1.5 / (1.5 + h)."""
    s = PredictionSettings()
    belief = belief_of([Box(2.0, -3, 3, 3, -0.3, 0.0)], twist=BodyTwist(0.4, 0.0, 0.0))
    predicted = ArrivalField(s, 0.12).update(belief)
    x = np.linspace(0.0, 2.0, 20001)
    h = np.minimum(x / 0.4, s.horizon_max_s)
    reached = x[2.0 - x - 0.3 * h * s.trust_decay_s / (s.trust_decay_s + h) <= 0.0][0]
    at = belief.clearance.lattice
    row, column = (int(v) for v in np.array(at.cell_of(np.array([[0.5, 0.0]]))).ravel())
    wall_x = at.x_m + (column + 0.5) * at.cell_m + predicted.clearance_m[row, column]
    assert wall_x == pytest.approx(reached, abs=1.5 * at.cell_m)


def test_a_receding_wall_and_a_still_one_are_left_where_they_are():
    for speed in (0.0, 0.4):
        belief = belief_of([Box(1.5, -3, 3, 3, speed, 0.0)])
        predicted = ArrivalField(PredictionSettings(), 0.12).update(belief)
        near = belief.clearance.clearance_m < 2.0
        assert predicted.clearance_m[near] == pytest.approx(belief.clearance.clearance_m[near], abs=0.08)


@pytest.mark.parametrize("share", [0.0, 0.002, 0.1, 1.0])
def test_what_will_be_taken_lowers_the_field_to_the_transform_of_both_to_the_bit(share):
    rng = np.random.default_rng(11)
    now, then = rng.random((40, 53)) < 0.02, rng.random((40, 53)) < share
    both = lowered(distance_to(now, 0.05), (then & ~now).astype(np.uint8), 0.05)
    assert np.array_equal(both, distance_to(now | then, 0.05))


def test_what_is_out_of_view_is_trusted_less_with_age():
    field = ArrivalField(PredictionSettings(fov_deg=90.0), 0.12)
    behind, ahead = SE2(0.0, 0.0, np.pi), SE2()
    closing = Box(2.0, -3, 3, 3, -0.5, 0.0)
    seen = field.update(belief_of([closing], ahead)).clearance_m
    belief = belief_of([closing], behind, tick=10**10)  # ten seconds on, looking away; the rates are still there
    old = field.update(belief).clearance_m
    assert old.sum() > seen.sum()


@pytest.mark.parametrize("velocity", [(-0.8, 0.0), (-0.5, 0.5), (0.0, -0.7)])
def test_the_velocity_of_what_closes_in_follows_from_slopes_and_rates_and_half_of_it_counts_at_first(velocity):
    belief = belief_of([Disc(1.6, 0.4, 0.3, *velocity)])
    (x, y, vx, vy, cells), *others = ArrivalField(PredictionSettings(), 0.12).update(belief).closing
    assert not np.any(others)
    assert cells > 20
    assert (x, y) == pytest.approx((1.6, 0.4), abs=0.25)
    assert (vx, vy) == pytest.approx(0.5 * np.array(velocity), abs=0.06)


def test_a_branch_does_not_hop_between_the_sides_of_an_obstacle():
    offsets = np.linspace(-1.0, 1.0, 21)
    costs = np.zeros((8, 21))
    costs[2:6, 8:13] = 50.0  # an obstacle in the middle
    costs[2, 16:] -= 0.2  # to its left it is better first,
    costs[3:6, :5] -= 0.3  # to its right later
    y, _ = cheapest_branch(costs, offsets, np.full(7, 0.3), 0.0, 1.5)
    assert (y[2:6] < -0.2).all() or (y[2:6] > 0.2).all()


def test_a_branch_does_not_lead_through_what_stands_between_two_stations():
    """A wall across all of the corridor, with room in the last column only: no slope of less than 80 degrees gets there."""
    offsets, costs = np.linspace(-1.0, 1.0, 31), np.zeros((8, 31))
    costs[3, :30] = 40.0
    y, _ = cheapest_branch(costs, offsets, np.full(7, 0.2), 0.0, 0.01)
    assert np.abs(np.diff(y)).max() <= STEEP * 0.2 + 1e-9
    assert y[3] == pytest.approx(1.0)  # with a slope of 2 it is reached in three steps
    costs[1:5, :30] = 40.0
    near, _ = cheapest_branch(costs, offsets, np.full(7, 0.2), 0.0, 0.01)
    assert np.abs(np.diff(near)).max() <= STEEP * 0.2 + 1e-9


def test_the_ground_before_the_robot_is_looked_at_from_the_near_end_of_view_on_or_stood_on():
    field = ArrivalField(PredictionSettings(fov_deg=90.0, near_m=0.46), 0.12)
    field.update(belief_of([]))
    belief = belief_of([], tick=5 * 10**9)
    field.update(belief)
    at = np.array([[0.0, 0.0], [0.3, 0.0], [0.6, 0.0], [-0.6, 0.0]])
    assert sample(field.met_s, belief.clearance.lattice, at).tolist() == pytest.approx([0.0, 5.0, 0.0, 5.0])
    assert sample(field.age_s, belief.clearance.lattice, at)[1] == 0.0


def test_a_chart_ends_at_the_goal_and_bends_with_the_route():
    path = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]])
    goal = np.array([2.0, 4.0])
    chart = lay_chart(path, goal, np.zeros((0, 2)), ChartSettings())
    assert chart.line[-1] == pytest.approx(goal)
    assert np.hypot(*np.diff(chart.line, axis=0).T).max() <= STEP_M + 1e-9
    arc, offset = chart.project(np.array([[1.9, 3.0], [0.5, 0.3]]))[:, 0], chart.project(np.array([[1.9, 3.0], [0.5, 0.3]]))[:, 1]
    assert offset == pytest.approx([0.1, 0.3], abs=0.02)
    assert arc[0] > arc[1]


def test_braking_length_and_known_length():
    speed = brakable(0.3, 0.5, 0.05)
    assert speed * 0.05 + speed**2 / (2 * 0.5) == pytest.approx(0.3)
    known = np.ones((20, 20), np.bool_)
    known[:, 12:] = False
    ahead = np.array([[0.05, 1.0], [1.9, 1.0]])
    assert known_length(known, np.zeros(2), 0.1, ahead, 0.1, 0.15) == pytest.approx(1.15, abs=0.06)
    known[:, 12:14] = True
    known[:, 13] = False  # a hole of one cell is no edge
    known[:, 14:] = True
    assert known_length(known, np.zeros(2), 0.1, ahead, 0.1, 0.15) == pytest.approx(1.85)
