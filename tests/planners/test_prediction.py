"""Obstacle futures: conjectures that explain what is seen gain weight, samples are spread as they say, and are the same again."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from drivers.interface.samples import frozen_array
from drivers.interface.stateful import Stateful
from estimators.belief import Track
from planners.prediction.chance import Chance
from planners.prediction.conjectures import ConjectureFamily
from planners.prediction.constant_velocity import ConstantVelocityPredictor
from planners.prediction.kernels import followed
from planners.prediction.observed import observed
from planners.prediction.posterior import floored, heaviest, updated
from planners.prediction.predictor import Occasion, Predictor
from planners.prediction.random_walk import RandomWalkPredictor
from planners.prediction.settings import FAMILY, PredictionSettings
from planners.prediction.walls import Walls, keep_out
from tests.planners.synthetic import belief_of

ROBOT_M, STEP_S = 0.3, 0.1
BELIEF = belief_of([])
TIMES_S = STEP_S * np.arange(1, 21)
FAR = np.full((20, 2), 50.0)


def track(x, y, vx=0.0, vy=0.0, identity=0, covariance=None):
    return Track(identity, (x, y), (vx, vy), 0.2, frozen_array(np.zeros((4, 4)) if covariance is None else covariance))


def seen(tick, *tracks):
    return replace(BELIEF, tick=tick, stamp_ns=(tick + 1) * 100_000_000, tracks=tracks)


def family(**settings):
    return ConjectureFamily(PredictionSettings.model_validate(settings), ROBOT_M)


def predictors():
    return [family(), family(per_obstacle=True), ConstantVelocityPredictor(), RandomWalkPredictor(0.4)]


def weights_of(predictor):
    return dict(zip(predictor.conjectures, predictor.weights.tolist(), strict=True))


@pytest.mark.parametrize("predictor", predictors(), ids=["family", "per obstacle", "constant velocity", "random walk"])
def test_the_contract(predictor):
    assert isinstance(predictor, Predictor)
    assert isinstance(predictor, Stateful)
    predictor.warm_up()
    predictor.observe(seen(0, track(3.0, 0.0, -0.5), track(2.0, 2.0, 0.3, identity=7)))
    predictor.observe(seen(1, track(2.95, 0.0, -0.5), track(2.03, 2.0, 0.3, identity=7), track(9.0, 9.0, identity=8)))
    first, again = (predictor.sample(Occasion(TIMES_S, FAR, 32), Chance(3, "test")) for _ in range(2))
    assert first.position_in_odom.shape == (20, 3, 2, 32)
    assert first.position_in_odom.dtype == np.float32
    assert first.scenarios == 32
    assert np.array_equal(first.position_in_odom, again.position_in_odom)
    assert first.conjecture.shape == (3, 32)
    assert predictor.weights.sum() == pytest.approx(1.0)
    assert len(predictor.weights) == len(predictor.conjectures)
    predictor.observe(seen(2))
    assert predictor.sample(Occasion(TIMES_S, FAR, 32), Chance(3, "test")).position_in_odom.shape == (20, 0, 2, 32)


@pytest.mark.parametrize(("factor", "favoured"), [(0.0, "static"), (0.5, "slow"), (1.0, "constant"), (1.5, "fast")])
def test_the_conjecture_that_explains_the_motion_gains_most(factor, favoured):
    """The track's velocity lags behind what the obstacle really does, as a filter's does when it changes its speed."""
    predictor = family()
    for tick in range(40):
        predictor.observe(seen(tick, track(5.0 + factor * 0.8 * STEP_S * tick, 4.0, 0.8, 0.0)))
    weights, prior = weights_of(predictor), weights_of(family())
    gain = {name: weights[name] / prior[name] for name in FAMILY[:4]}  # out of their reach the last two are as good as constant
    assert max(gain, key=gain.__getitem__) == favoured
    assert min(weights.values()) >= 0.02 - 1e-12


def test_who_turns_to_the_robot_is_taken_for_aggressive_and_who_slows_down_for_yielding():
    chased, met = family(), family()
    at, x = np.array([-1.2, 1.0]), 1.5
    for tick in range(25):
        chased.observe(seen(tick, track(*at, 0.6, 0.0)))
        g = 1.0 - (np.hypot(*at) - 0.5) / 2.0
        at += STEP_S * (np.array([0.6 * (1.0 + 0.25 * g), 0.0]) - 0.35 * g * 0.6 * at / np.hypot(*at))
        met.observe(seen(tick, track(x, 0.0, -0.6, 0.0)))
        x -= 0.6 * STEP_S * max(0.2, min(1.0, (x - 0.5) / 2.0))
    assert weights_of(chased)["aggressive"] > weights_of(family())["aggressive"]
    assert weights_of(met)["yielding"] > weights_of(family())["yielding"]


def test_the_fixed_predictor_keeps_its_prior():
    predictor = family(update=False)
    for tick in range(20):
        predictor.observe(seen(tick, track(5.0, 4.0, 0.8)))
    assert weights_of(predictor) == weights_of(family(update=False))


def test_with_a_posterior_each_two_obstacles_are_told_apart():
    predictor = family(per_obstacle=True)
    for tick in range(40):
        predictor.observe(seen(tick, track(5.0, 4.0, 0.8), track(5.0 + 0.08 * tick, -4.0, 0.8, identity=1)))
    futures = predictor.sample(Occasion(TIMES_S, FAR, 400), Chance(1, "test"))
    names = np.array(FAMILY)
    assert (names[futures.conjecture[0]] == "static").mean() > 0.5
    assert (names[futures.conjecture[1]] == "static").mean() < 0.1


def test_a_new_crowd_is_met_with_the_prior():
    predictor = family()
    for tick in range(20):
        predictor.observe(seen(tick, track(5.0, 4.0, 0.8)))
    predictor.observe(seen(20))
    assert weights_of(predictor) == pytest.approx(weights_of(family()))


def test_the_correction_is_the_kalman_filters():
    """One axis by hand, with matrices; the density is that of the innovation."""
    dt, q, noise = 0.1, 0.5, np.array([0.02, 0.003, 0.05])
    mean, spread = np.array([[[1.0, 2.0, 0.4, -0.3]]]), np.array([[[0.1, 0.02, 0.2]]])
    observation = np.array([[1.1, 1.9, 0.5, -0.2]])
    coefficients = np.array([[0.5, 0.0, 0.0, 0.0, q, 0.05, 0.1]])
    told = followed(mean, spread, np.zeros(1, np.int64), coefficients, observation, noise[None], np.ones(1), np.zeros(2), 1.0, dt)
    f, p = np.array([[1.0, 0.5 * dt], [0.0, 1.0]]), np.array([[0.1, 0.02], [0.02, 0.2]])
    push = np.array([[0.5 * dt * dt], [dt]])
    p = f @ p @ f.T + q * q * push @ push.T
    r = np.array([[0.02 + 0.05**2, 0.003], [0.003, 0.05 + 0.1**2]])
    gain, density = p @ np.linalg.inv(p + r), 0.0
    for axis in range(2):
        state = f @ mean[0, 0, axis::2]
        innovation = observation[0, axis::2] - state
        density += -0.5 * innovation @ np.linalg.solve(p + r, innovation)
        density += -0.5 * math.log(np.linalg.det(2.0 * math.pi * (p + r)))
        assert told[0][0, 0, axis::2] == pytest.approx(state + gain @ innovation)
    after = p - gain @ p
    assert told[1][0, 0] == pytest.approx([after[0, 0], after[0, 1], after[1, 1]])
    assert told[2][0, 0] == pytest.approx(density)


def test_samples_of_constant_velocity_are_spread_as_the_covariance_carried_on():
    covariance = np.diag([0.04, 0.04, 0.09, 0.09])
    covariance[0, 2] = covariance[2, 0] = covariance[1, 3] = covariance[3, 1] = 0.03
    predictor = ConstantVelocityPredictor()
    predictor.observe(seen(0, track(1.0, 2.0, 0.5, -0.2, covariance=covariance)))
    position = predictor.sample(Occasion(np.array([2.0]), FAR[:1], 40_000), Chance(1, "test")).position_in_odom[0, 0]
    assert position.mean(axis=1) == pytest.approx([2.0, 1.6], abs=0.01)
    assert position.var(axis=1) == pytest.approx([0.04 + 4.0 * 0.03 + 4.0 * 0.09] * 2, rel=0.03)


def test_a_random_walk_spreads_with_the_root_of_the_time():
    predictor = RandomWalkPredictor(0.5)
    predictor.observe(seen(0, track(1.0, 2.0, 0.5, -0.2)))
    position = predictor.sample(Occasion(TIMES_S, FAR, 20_000), Chance(1, "test")).position_in_odom[:, 0]
    assert position[-1].mean(axis=1) == pytest.approx([1.0, 2.0], abs=0.02)
    assert position.var(axis=2)[:, 0] == pytest.approx(0.25 * TIMES_S, rel=0.05)


@pytest.mark.parametrize(("name", "speed"), [("static", 0.0), ("slow", 0.25), ("constant", 0.5), ("fast", 0.75)])
def test_a_conjecture_alone_drives_at_its_share_of_the_tracked_speed(name, speed):
    predictor = family(family=[name])
    predictor.observe(seen(0, track(1.0, 2.0, 0.5, 0.0)))
    position = predictor.sample(Occasion(TIMES_S, FAR, 500), Chance(1, "test")).position_in_odom[-1, 0]
    assert position.mean(axis=1) == pytest.approx([1.0 + 2.0 * speed, 2.0], abs=0.02)


def test_the_last_two_react_to_where_the_robot_is_meant_to_be():
    robot = np.zeros((20, 2))
    for name, nearer in (("yielding", False), ("aggressive", True), ("constant", None)):
        predictor = family(family=[name])
        predictor.observe(seen(0, track(1.2, 0.8, -0.4, 0.0)))
        near, far = (
            predictor.sample(Occasion(TIMES_S, path, 200), Chance(1, "test")).position_in_odom[-1, 0] for path in (robot, FAR)
        )
        gap_near, gap_far = (np.hypot(*position).mean() for position in (near, far))
        if nearer is None:
            assert np.array_equal(near, far)
        else:
            assert (gap_near < gap_far) == nearer


def test_uncertain_tracks_are_drawn_within_the_cap():
    predictor = family()
    predictor.observe(seen(0, track(1.0, 2.0, covariance=np.diag([1e8] * 4))))
    start = predictor.sample(Occasion(np.array([1e-3]), FAR[:1], 2000), Chance(1, "test")).position_in_odom[0, 0]
    assert start.std(axis=1) == pytest.approx([1.0, 1.0], rel=0.1)


def test_tracks_that_are_not_finite_are_left_out():
    told = observed((track(math.nan, 0.0), track(1.0, 2.0, identity=5), track(0.0, 0.0, covariance=np.full((4, 4), np.inf))))
    assert told.identity.tolist() == [5]
    assert told.left_out == 2


def test_tempering_flattens_and_the_floor_holds():
    prior, evidence = np.array([0.5, 0.3, 0.2]), np.log([0.9, 0.05, 0.05])
    sharp, flat = (updated(prior[None], evidence[None], tau, 0.0)[0] for tau in (1.0, 10.0))
    assert sharp == pytest.approx(np.array([0.45, 0.015, 0.01]) / 0.475)
    assert sharp[0] > flat[0] > prior[0]
    assert updated(prior[None], np.array([[0.0, -1e6, -1e6]]), 1.0, 0.05)[0].tolist() == pytest.approx([0.9, 0.05, 0.05])
    assert floored(prior, 0.1).tolist() == prior.tolist()
    assert floored(np.array([0.89, 0.11, 0.0]), 0.1).tolist() == pytest.approx([0.8, 0.1, 0.1])


def test_the_top_k_are_renormalised():
    rows = heaviest(np.array([[0.4, 0.1, 0.3, 0.2], [0.25, 0.25, 0.25, 0.25]]), 2)
    assert rows == pytest.approx(np.array([[4 / 7, 0.0, 3 / 7, 0.0], [0.5, 0.5, 0.0, 0.0]]))


@pytest.mark.parametrize("wrong", [{"family": []}, {"family": ["slow", "slow"]}, {"floor": 0.2}, {"family": ["hasty"]}])
def test_settings_that_make_no_sense_are_refused(wrong):
    with pytest.raises(ValidationError):
        PredictionSettings.model_validate(wrong)


def test_fewer_scenarios_and_fewer_rows_are_the_first_of_more():
    chance = Chance(7, "test")
    few, many = chance.normal("start", 2, 4, 16), chance.normal("start", 3, 4, 64)
    assert np.array_equal(few, many[:2, :, :16])
    assert np.array_equal(few, chance.normal("start", 2, 4, 16))
    assert np.array_equal(chance.uniform("conjecture", 1, 8)[0], Chance(7, "test").uniform("conjecture", 2, 24)[0, :, :8])
    assert not np.array_equal(few, Chance(8, "test").normal("start", 2, 4, 16))
    assert not np.array_equal(many[0], many[1])


def walled(position, radius=0.25):
    """Return futures beside a wall of cells at x = 2, each shape (steps, 2), after walls were made to hold."""
    x = np.arange(-1.0, 4.0, 0.05) + 0.025
    field = np.repeat(np.abs(x - 2.025)[None], 100, axis=0).astype(np.float32)  # (rows, columns)
    futures = np.asarray(position, np.float32)[:, None, :, None].copy()
    keep_out(futures, np.array([radius]), Walls(field, -1.0, -1.0, 0.05))
    return futures[:, 0, :, 0]


def test_nobody_goes_through_a_wall_but_along_it():
    steps = np.arange(1, 26)
    oblique = walled(np.stack((0.08 * steps, 0.04 * steps), axis=1))
    assert oblique[:, 0].max() < 2.0
    assert np.diff(oblique[:, 1]).min() > 0.0  # what leads along the wall stays
    assert oblique[-1, 1] == pytest.approx(1.0, abs=0.05)
    straight = walled(np.stack((0.08 * steps, np.zeros(25)), axis=1))
    assert 1.65 < straight[-1, 0] < 1.9  # 0.7 of the radius from the wall, to a cell and a step of two


def test_who_meets_no_wall_goes_on_as_he_was_drawn_and_his_own_cells_do_not_hold_him():
    steps = np.arange(1, 26)
    free = np.stack((0.05 * steps - 0.5, 0.03 * steps), axis=1).astype(np.float32)
    assert np.array_equal(walled(free), free)
    leaving = np.stack((2.0 - 0.05 * steps, np.zeros(25)), axis=1).astype(np.float32)
    assert np.array_equal(walled(leaving), leaving)
