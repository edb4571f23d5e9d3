import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from planners.graceful.kernels import Field, Law, curvature_of, rotation, simulate, smooth
from planners.graceful.planner import Graceful
from tests.planners.followers import WORLDS, planner_of, route_along, run
from tests.planners.synthetic import DIFFERENTIAL, OMNI, Box, Disc, belief_of

LINE = np.array([[0.0, 0.0], [5.0, 0.0]])
LAW = Law(2.0, 1.0, 0.4, 2.0, 1.5, 0.1, 0.5, 1.0, 0.25, 0.5, 0.75)
OPEN = Field(np.full((200, 200), 9.0, np.float32), -5.0, -5.0, 0.05, 0.17)


def graceful(limits=DIFFERENTIAL, **settings):
    return planner_of(Graceful, limits, **settings)


@pytest.mark.parametrize(("limits", "obstacles", "goal"), WORLDS.values(), ids=WORLDS)
def test_it_arrives_without_touching(limits, obstacles, goal):
    trace = run(graceful(limits), obstacles, goal, limits)
    assert trace.reached(*goal, tolerance_m=0.21)
    assert trace.min_clearance_m > 0.08


def converged(pose, target, law=LAW, seconds=60.0, dt=0.01):
    """Where the law leads, by plain integration."""
    state = np.array(pose, dtype=np.float64)
    for _ in range(round(seconds / dt)):
        if math.hypot(*(np.array(target[:2]) - state[:2])) < 0.02:
            break
        speed, turn = smooth(state, np.array(target), law)
        state += dt * np.array([speed * math.cos(state[2]), speed * math.sin(state[2]), turn])
    return state


@pytest.mark.parametrize("target", [(2.0, 0.0, 0.0), (1.5, 1.0, 1.2), (1.0, -1.5, -2.5), (-1.0, 0.5, 0.3)])
def test_the_law_reaches_the_target_and_its_heading(target):
    """Park and Kuipers, section III: the pose is globally attractive."""
    state = converged((0.0, 0.0, 0.0), target, LAW._replace(slowest_m_s=1e-4))
    assert state[:2] == pytest.approx(target[:2], abs=0.03)
    assert math.remainder(state[2] - target[2], 2.0 * math.pi) == pytest.approx(0.0, abs=0.15)


@pytest.mark.parametrize("phi", [-1.0, 0.0, 0.7])
def test_on_the_slow_manifold_only_its_slope_steers(phi):
    """Equation 13: with delta = atan(-k1 phi), the error term vanishes."""
    delta, r = math.atan(-2.0 * phi), 1.5
    expected = -(1.0 + 2.0 / (1.0 + (2.0 * phi) ** 2)) * math.sin(delta) / r
    assert curvature_of(r, phi, delta, 2.0, 1.0) == pytest.approx(expected)


@pytest.mark.parametrize("target", [(1.0, 0.2, 0.4), (0.4, 0.4, -1.0), (2.0, -0.6, 0.0)])
def test_mirrored_targets_are_driven_to_in_mirror_image(target):
    here, mirrored = np.zeros(3), np.array([target[0], -target[1], -target[2]])
    speed, turn = smooth(here, np.array(target), LAW)
    assert smooth(here, mirrored, LAW) == pytest.approx((speed, -turn))


def test_a_curve_that_asks_for_too_fast_a_turn_is_driven_slower_not_wider():
    law = LAW._replace(turn_rad_s=0.2, slowest_m_s=0.01)
    free, target = LAW._replace(turn_rad_s=9.0, slowest_m_s=0.01), np.array([0.5, 0.4, 1.5])
    bound_speed, bound_turn = smooth(np.zeros(3), target, law)
    speed, turn = smooth(np.zeros(3), target, free)
    assert bound_turn == pytest.approx(0.2)
    assert bound_turn / bound_speed == pytest.approx(turn / speed)


def test_it_slows_down_near_the_target_and_in_curves():
    straight = [smooth(np.zeros(3), np.array([d, 0.0, 0.0]), LAW)[0] for d in (0.15, 0.75, 3.0)]
    assert straight == pytest.approx([0.1, 0.25, 0.5])
    assert smooth(np.zeros(3), np.array([3.0, 2.0, 0.6]), LAW)[0] < 0.5


@pytest.mark.parametrize(("angle", "rate"), [(2.5, 1.0), (-1.0, -0.5), (0.1, 0.25), (-0.01, -0.25)])
def test_a_turn_on_the_spot_is_in_proportion_within_its_bounds(angle, rate):
    assert rotation(angle, LAW) == pytest.approx(rate)


def test_the_simulation_is_the_law_a_cell_at_a_time():
    way, target = np.empty((200, 3)), np.array([1.0, 0.3, 0.5])
    count, speed, turn = simulate(np.zeros(3), target, LAW, OPEN, way)
    assert (speed, turn) == smooth(np.zeros(3), target, LAW)
    fine = np.zeros(3)
    for _ in range(100 * count):
        v, w = smooth(fine, target, LAW)
        fine += 0.001 * np.array([v * math.cos(fine[2]), v * math.sin(fine[2]), w])
    assert way[count - 1] == pytest.approx(fine, abs=0.03)


def test_a_simulation_that_meets_an_obstacle_ends_there():
    belief = belief_of([Disc(0.6, 0.0, 0.1)])
    lattice = belief.clearance.lattice
    field = Field(belief.clearance.clearance_m, lattice.x_m, lattice.y_m, lattice.cell_m, 0.17)
    assert simulate(np.zeros(3), np.array([1.0, 0.0, 0.0]), LAW, field, np.empty((200, 3)))[0] == 0
    assert simulate(np.zeros(3), np.array([0.25, 0.0, 0.0]), LAW, field, np.empty((200, 3)))[0] > 0


def test_the_farthest_target_in_reach_is_chosen():
    free = graceful().plan(belief_of([]), route_along(LINE))
    assert free.diagnostics.target_m == pytest.approx(1.0)
    assert free.diagnostics.nearer_targets == 0
    near = graceful().plan(belief_of([Disc(0.9, 0.0, 0.1)]), route_along(LINE))
    assert 0.4 < near.diagnostics.target_m < 0.75
    assert near.diagnostics.nearer_targets > 4
    assert near.base.vx > 0.0


def test_with_no_target_in_reach_it_stands_and_says_so():
    plan = graceful().plan(belief_of([Box(0.3, -3.0, 1.0, 3.0)]), route_along(LINE))
    assert plan.base == BodyTwist()
    assert plan.diagnostics.standing == "every target collides"


def test_a_target_aside_is_turned_to_first():
    aside = route_along([[0.0, 0.0], [-0.5, 1.0], [-1.0, 3.0]])
    turning = graceful().plan(belief_of([]), aside)
    assert turning.base.vx == 0.0
    assert turning.base.wz > 0.25
    assert turning.diagnostics.rotating
    assert graceful(initial_rotation=False).plan(belief_of([]), aside).base.vx > 0.0


def test_it_turns_to_the_heading_that_the_goal_asks_for():
    trace = run(graceful(), [], (2.0, 0.0), goal_yaw=2.0, duration_s=20.0)
    assert trace.reached(2.0, 0.0, tolerance_m=0.1)
    assert trace.poses[-1].yaw == pytest.approx(2.0, abs=0.1)


def test_it_prefers_a_turn_at_the_end_to_a_sweep_that_ends_in_the_heading():
    route = route_along([[0.0, 0.0], [0.8, 0.0]], goal_yaw=math.pi / 2)
    turned, sweeping = (graceful(prefer_final_rotation=p).plan(belief_of([]), route) for p in (True, False))
    assert turned.base.wz == pytest.approx(0.0, abs=1e-9)
    assert sweeping.base.wz < -0.05


def test_commands_stay_inside_the_base_s_caps_and_without_sideways_motion():
    slow = replace(OMNI, velocity=BodyTwist(0.2, 0.5, 0.3))
    for path in ([[0.0, 0.0], [0.3, 0.2], [0.5, 1.0]], [[0.0, 0.0], [-2.0, 0.1]]):
        twist = graceful(slow).plan(belief_of([]), route_along(path)).base
        assert 0.0 <= twist.vx <= 0.2
        assert twist.vy == 0.0
        assert abs(twist.wz) <= 0.3


def test_the_viewer_shows_the_target_and_the_way_to_it():
    plan = graceful().plan(belief_of([]), route_along([[0.0, 0.0], [1.0, 0.5], [3.0, 0.5]]))
    target, way = (next(d.points_in_odom for d in plan.drawings if d.name == name) for name in ("target", "simulated"))
    assert math.hypot(*(way[-1] - target[0])) < 0.3
    assert way[0].tolist() == [0.0, 0.0]
