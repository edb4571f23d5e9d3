import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import savgol_filter

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from planners.mppi.critic_kernels import Costmap, collision_free, furthest_reached, inflate, obstacles, path_distance
from planners.mppi.kernels import average, charge_change, limit, roll_out, sample_controls
from planners.mppi.optimizer import Optimizer
from planners.mppi.planner import Mppi
from planners.planner import PlannerSetup
from tests.planners.followers import PERIOD_S, RADIUS_M, WORLDS, planner_of, route_along, run
from tests.planners.synthetic import DIFFERENTIAL, OMNI, Box, Disc, belief_of

LINE = [[0.0, 0.0], [5.0, 0.0]]
ZERO = np.float32(0.0)


def mppi(limits=DIFFERENTIAL, seed=0, **settings):
    return planner_of(Mppi, limits, seed, **settings)


def settled(planner, belief, route, ticks=30):
    """Decide again and again where nothing changes, as the warm start converges."""
    for _ in range(ticks):
        plan = planner.plan(belief, route)
    return plan


@pytest.mark.parametrize(("limits", "obstacles", "goal"), WORLDS.values(), ids=WORLDS)
def test_it_arrives_without_touching(limits, obstacles, goal):
    trace = run(mppi(limits), obstacles, goal, limits)
    assert trace.reached(*goal, tolerance_m=0.21)
    assert trace.min_clearance_m > 0.08


@pytest.mark.parametrize("limits", [DIFFERENTIAL, OMNI], ids=["differential", "omni"])
def test_it_turns_to_the_heading_that_the_goal_asks_for(limits):
    trace = run(mppi(limits), [], (2.0, 0.0), limits, goal_yaw=2.0)
    assert trace.reached(2.0, 0.0, tolerance_m=0.1)
    assert trace.poses[-1].yaw == pytest.approx(2.0, abs=0.15)


def test_it_leaves_a_route_that_something_stands_on():
    """The route still leads through the pillar; a follower that could not leave it would stand."""
    planner, pose, twist = mppi(), SE2(), BodyTwist()
    pillar = [Disc(1.5, 0.05, 0.25)]
    nearest = math.inf
    for tick in range(200):
        belief = belief_of(pillar, pose, twist, tick=tick)
        twist = planner.plan(belief, route_along([[0.0, 0.0], [4.0, 0.0]])).base
        pose = pose.integrate(twist.vx, twist.vy, twist.wz, PERIOD_S)
        nearest = min(nearest, float(pillar[0].distance(pose.x, pose.y)))
    assert pose.x > 3.5
    assert nearest > 0.15


def test_roll_outs_are_exact_arcs_to_single_precision_and_the_step_s_chord():
    rng = np.random.default_rng(1)
    controls = rng.uniform(-1.5, 1.5, (3, 30, 4)).astype(np.float32)
    x, y, yaw = (np.zeros((30, 4), np.float32) for _ in range(3))
    roll_out(controls, np.array([0.5, -0.3, 2.0], np.float32), np.float32(0.1), x, y, yaw)
    for b in range(4):
        pose = SE2(0.5, -0.3, 2.0)
        for k in range(30):
            pose = pose.integrate(*controls[:, k, b].tolist(), 0.1)
        assert (x[-1, b], y[-1, b]) == pytest.approx((pose.x, pose.y), abs=0.005)  # a chord is shorter than its arc
        assert math.remainder(yaw[-1, b] - pose.yaw, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-5)


def test_sampled_controls_keep_the_accelerations_from_the_velocity_now():
    rng = np.random.default_rng(2)
    noise = rng.normal(0.0, 1.0, (3, 30, 50)).astype(np.float32)
    now, reach = np.array([0.4, -0.1, 0.3], np.float32), np.array([0.15, 0.1, 0.4], np.float32)
    controls = np.empty_like(noise)
    sample_controls(np.zeros((3, 30), np.float32), noise, now, reach, controls)
    steps = np.diff(np.concatenate((np.broadcast_to(now[:, None, None], (3, 1, 50)), controls), axis=1), axis=1)
    assert (np.abs(steps) <= reach[:, None, None] + 1e-6).all()
    free = np.empty_like(noise)
    sample_controls(np.ones((3, 30), np.float32), noise, now, np.full(3, 99.0, np.float32), free)
    assert free == pytest.approx(1.0 + noise)


def test_the_average_is_the_softmax_of_the_costs():
    rng = np.random.default_rng(3)
    controls, costs = rng.normal(size=(3, 12, 40)).astype(np.float32), rng.uniform(0.0, 2.0, 40).astype(np.float32)
    weights = np.exp(-(costs - costs.min()) / 0.3)
    weights /= weights.sum()
    mean, effective = average(controls, costs, 0.3)
    assert mean == pytest.approx(controls @ weights, abs=1e-5)
    assert effective == pytest.approx(1.0 / (weights**2).sum(), rel=1e-4)
    coldest, one = average(controls, costs, 1e-4)
    assert coldest == pytest.approx(controls[:, :, costs.argmin()], abs=1e-4)
    assert one == pytest.approx(1.0, abs=0.01)


def test_change_costs_what_the_importance_weights_say():
    rng = np.random.default_rng(4)
    controls, sequence = (rng.normal(size=s).astype(np.float32) for s in ((3, 12, 5), (3, 12)))
    price, costs = np.array([0.4, 0.0, 0.1], np.float32), np.ones(5, np.float32)
    charge_change(controls, sequence, price, costs)
    expected = 1.0 + np.einsum("a,ak,akb->b", price, sequence, controls - sequence[:, :, None])
    assert costs == pytest.approx(expected, abs=1e-4)


def test_a_sequence_is_kept_inside_caps_and_accelerations():
    sequence = np.full((3, 20), 9.0, np.float32)
    limit(sequence, np.zeros(3, np.float32), *(np.full(3, v, np.float32) for v in (0.1, -0.5, 0.5)))
    assert sequence[0, :6] == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5, 0.5])


def test_inflated_costs_are_those_of_a_costmap():
    clearance = np.array([[0.0, 0.29, 0.31, 0.5, 0.69, 0.71, 2.0]], np.float32)
    cost = np.empty_like(clearance)
    inflate(clearance, 0.3, 0.7, 3.0, cost)
    falling = [252.0 * math.exp(-3.0 * d) for d in (0.01, 0.2, 0.39)]
    assert cost[0] == pytest.approx([253.0, 253.0, *falling, 0.0, 0.0], rel=1e-4)


def test_obstacles_cost_their_mean_and_collisions_dearly():
    """Nav2's normalisation: weight / 254, averaged over the trajectory; a collision costs its fixed price instead."""
    cost = np.array([[0.0, 100.0, 200.0, 253.0]], np.float32)
    around = Costmap(cost, ZERO, ZERO, np.float32(1.0))
    x = np.array([[0.5, 1.5, 2.5], [0.5, 2.5, 3.5], [7.5, 2.5, 1.5]], np.float32)  # (steps, batch); 7.5 is off the map
    y, costs = np.full_like(x, 0.5), np.zeros(3, np.float32)
    assert obstacles(x, y, around, 3.81, 1e6, True, costs) == 2
    assert costs == pytest.approx([0.0, 3.81 * 500.0 / 254.0 / 3.0, 3.81 * 1e6 / 254.0 / 3.0])
    near_goal = np.zeros(3, np.float32)
    obstacles(x, y, around, 3.81, 1e6, False, near_goal)
    assert (near_goal > 0.0).tolist() == [False, False, True]
    points = np.array([[0.5, 0.5], [3.5, 0.5], [-1.0, 0.5]], np.float32)
    assert collision_free(around, points).tolist() == [True, False, True]


def test_path_alignment_compares_points_equally_far_along():
    path = np.stack((np.arange(0.0, 3.0, 0.05), np.zeros(60)), axis=1).astype(np.float32)
    steps = np.arange(1, 31) * 0.05
    straight, aside, slanting = (np.zeros(30), steps), (np.full(30, 0.2), steps), (steps / math.sqrt(2), steps / math.sqrt(2))
    y = np.stack((straight[0], aside[0], slanting[0]), axis=1).astype(np.float32)
    x = np.stack((straight[1], aside[1], slanting[1]), axis=1).astype(np.float32)
    costs, open_ = np.zeros(3, np.float32), np.ones(60, np.bool_)
    path_distance(x, y, ZERO, ZERO, path, open_, 2, 10.0, costs)
    visited = steps[1::2]
    assert costs[0] == pytest.approx(0.0, abs=1e-3)
    assert costs[1] == pytest.approx(10.0 * math.hypot(0.2, 0.1), abs=0.01)  # the way aside makes it longer, too
    assert costs[2] == pytest.approx(10.0 * 2.0 * math.sin(math.pi / 8) * visited.mean(), rel=0.02)
    blocked, open_[:] = np.zeros(3, np.float32), False
    path_distance(x, y, ZERO, ZERO, path, open_, 2, 10.0, blocked)
    assert (blocked == 0.0).all()


def test_the_furthest_point_is_the_one_nearest_to_the_end_of_the_best_trajectory():
    path = np.stack((np.arange(0.0, 2.0, 0.1), np.zeros(20)), axis=1).astype(np.float32)
    ends = np.array([[0.0, 1.52, 0.93]], np.float32)
    assert furthest_reached(ends, np.full_like(ends, 0.3), path) == 15


def test_the_noise_of_a_decision_is_the_seed_s():
    belief, route = belief_of([Disc(1.5, 0.05, 0.3)]), route_along(LINE)
    first, again, other = (settled(mppi(seed=s), belief, route, 3).base for s in (5, 5, 6))
    assert first == again
    assert first != other


@pytest.mark.parametrize("regenerate", [False, True])
def test_restored_planner_goes_on_identically(regenerate):
    belief, route = belief_of([Disc(1.2, 0.05, 0.3)]), route_along(LINE)
    first, second = (mppi(regenerate_noises=regenerate) for _ in range(2))
    settled(first, belief, route, 7)
    second.restore(first.snapshot())
    for _ in range(10):
        assert first.plan(belief, route).base == second.plan(belief, route).base


def test_warming_up_leaves_no_trace():
    cold, warm = (Mppi(Mppi.Settings(), PlannerSetup(PERIOD_S, RADIUS_M, DIFFERENTIAL, 0)) for _ in range(2))
    warm.warm_up()
    assert cold.snapshot() == warm.snapshot()


def test_the_warm_start_is_the_last_sequence_one_period_on():
    optimizer = Optimizer(Mppi.Settings(), DIFFERENTIAL, PERIOD_S, 0)
    optimizer.sequence[0] = np.linspace(0.0, 0.29, 30)
    optimizer.send()
    assert optimizer.sequence[0, :-1] == pytest.approx(np.linspace(0.0, 0.29, 30)[:-1] + 0.005)
    assert optimizer.sequence[0, -1] == pytest.approx(0.29)


def test_smoothing_is_savitzky_golay_s_over_what_was_sent_and_what_will_be():
    """With no noise the average is the last sequence itself: what is left of it is the filter."""
    settings = Mppi.Settings(vx_std_m_s=1e-6, vy_std_m_s=1e-6, wz_std_rad_s=1e-6, model_dt_s=PERIOD_S)
    optimizer = Optimizer(settings, DIFFERENTIAL, PERIOD_S, 0)
    sent = []
    for v in (0.10, 0.14, 0.12, 0.16):
        optimizer.sequence[:] = v
        sent.append(optimizer.send().vx)
    future = 0.18 + 0.02 * (-1.0) ** np.arange(30)
    optimizer.sequence[0] = future
    optimizer.start_from(BodyTwist(0.16, 0.0, 0.0))
    optimizer.sample(np.zeros(3))
    optimizer.average()
    expected = savgol_filter(np.concatenate((sent, future)), 9, 2, mode="nearest")[4:]
    assert optimizer.sequence[0] == pytest.approx(expected, abs=0.002)


@pytest.mark.parametrize("limits", [DIFFERENTIAL, OMNI], ids=["differential", "omni"])
def test_commands_stay_inside_the_caps_of_base_and_settings(limits):
    for vx, path in ((0.0, LINE), (0.5, [[0.0, 0.0], [-2.0, 1.0]]), (1.0, LINE)):
        twist = settled(mppi(limits), belief_of([], twist=BodyTwist(vx, 0.0, 0.0)), route_along(path), 5).base
        assert -0.35 <= twist.vx <= 0.5 + 1e-6
        assert abs(twist.vy) <= limits.velocity.vy + 1e-6
        assert abs(twist.wz) <= limits.velocity.wz + 1e-6


@pytest.mark.parametrize("limits", [DIFFERENTIAL, OMNI], ids=["differential", "omni"])
def test_reverse_is_refused_where_the_base_may_not(limits):
    limited = replace(limits, reverse=False)
    route = route_along([[0.0, 0.0], [-0.6, 0.0]])
    assert run(mppi(limited), [], (-1.5, 0.0), limited, duration_s=15.0).reached(-1.5, 0.0)
    assert settled(mppi(limited), belief_of([]), route).base.vx >= 0.0
    assert settled(mppi(limits, prefer_forward_weight=0.0), belief_of([]), route).base.vx < -0.05


def test_twirling_keeps_an_omni_base_from_turning():
    aside = route_along([[0.0, 0.0], [0.0, 3.0]])
    turning, gliding = (settled(mppi(OMNI, twirling_weight=w), belief_of([]), aside).base for w in (0.0, 30.0))
    assert abs(gliding.wz) < 0.5 * abs(turning.wz)
    assert gliding.vy > 0.1


def test_with_nothing_free_it_stands_and_says_so():
    belief = belief_of([Box(0.3, -3.0, 1.0, 3.0)], twist=BodyTwist(0.75, 0.0, 0.0))
    plan = mppi(margin_m=0.15).plan(belief, route_along(LINE))
    assert plan.base == BodyTwist()
    assert plan.diagnostics.standing == "every trajectory collides"
    assert plan.diagnostics.resets == 1


def test_an_average_between_two_ways_round_that_collides_is_not_sent():
    """Collisions hardly cost at this temperature: the mean goes straight on, into the post."""
    twist, driving = BodyTwist(0.5, 0.0, 0.0), mppi()
    settled(driving, belief_of([], twist=twist), route_along(LINE))
    planner = mppi(temperature=1e6, retry_attempt_limit=0, validated_s=3.0)
    planner.restore(driving.snapshot())
    plan = planner.plan(belief_of([Disc(1.3, 0.0, 0.05)], twist=twist), route_along(LINE))
    assert plan.diagnostics.free > 0
    assert plan.diagnostics.standing == "what was averaged collides"
    assert plan.base == BodyTwist()


def test_the_viewer_shows_the_cheapest_trajectories_and_what_was_made_of_them():
    plan = settled(mppi(drawn=3), belief_of([]), route_along(LINE))
    (cheapest,) = plan.drawings
    assert cheapest.points_in_odom.shape == (3 * 30, 2)
    assert plan.path_in_odom.shape == (30, 2)
    assert plan.path_in_odom[-1, 0] > 1.0
