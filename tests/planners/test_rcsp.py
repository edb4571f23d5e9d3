"""RCSP among discs that move: it waits out what would trap it, whatever it is given it answers safely, and always the same."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from drivers.interface.samples import frozen_array
from estimators.belief import Track
from planners.planner import Anytime, PlannerSetup, no_path
from planners.prediction.predictor import Futures
from planners.rcsp.budget import affordable
from planners.rcsp.clearance_kernels import clearances
from planners.rcsp.evaluation import Evaluation
from planners.rcsp.planner import Rcsp
from planners.rcsp.progress_kernels import to_go
from planners.rcsp.risk_kernels import INVERSE_CLEARANCE, NEAR_MISS, VIOLATION, Risk, largest, risk_of, risks_of, tails
from planners.router import Route, RouterSetup
from planners.routers.straight import StraightRouter
from planners.shield import ShieldSetup
from planners.shields.none import NoShield
from tests.contract.facts import facts, forget_kernels, signatures
from tests.planners.synthetic import DIFFERENTIAL, OMNI, ORIGIN, STANDING, Box, Disc, belief_of, drive, mission_to

PERIOD_S, RADIUS_M = 0.05, 0.25
WALLS = (Box(-1, -1.6, 9, -1.5), Box(-1, 1.5, 9, 1.6))


def planner_of(limits=DIFFERENTIAL, seed=0, **settings):
    return Rcsp(Rcsp.Settings.model_validate(settings), PlannerSetup(PERIOD_S, RADIUS_M, limits, seed))


def track(x, y, vx=0.0, vy=0.0, radius=0.25, identity=0, variance=0.0):
    return Track(identity, (x, y), (vx, vy), radius, frozen_array(np.diag([variance] * 4)))


def belief_with(*tracks, walls=WALLS, pose=ORIGIN, twist=STANDING, tick=1, **options):
    belief = belief_of(walls, pose, twist, tick=tick, **options)
    for array in (belief.clearance.clearance_m, belief.grid.label):
        frozen_array(array)
    return replace(belief, stamp_ns=tick * 50_000_000, tracks=tracks)


def straight(belief, x=6.0, y=0.0):
    return StraightRouter(StraightRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M)).route(belief, mission_to(x, y))


def planned(*tracks, planner=None, **options):
    belief = belief_with(*tracks, **options)
    return (planner or planner_of()).plan(belief, straight(belief))


class Tracking:
    """Lets a planner see the discs that move as tracks, as a perfect tracker would give them."""

    def __init__(self, planner, movers):
        self.planner, self.movers = planner, movers

    def plan(self, belief, route):
        time_s = belief.tick * PERIOD_S
        now = [disc.at(time_s) for disc in self.movers]
        tracks = tuple(track(d.x, d.y, d.vx, d.vy, d.radius, i) for i, d in enumerate(now))
        return self.planner.plan(replace(belief, stamp_ns=(belief.tick + 1) * 50_000_000, tracks=tracks), route)


def run(movers, goal, limits=DIFFERENTIAL, static=WALLS, **settings):
    shield = NoShield(NoShield.Settings(), ShieldSetup(PERIOD_S, RADIUS_M, limits))
    router = StraightRouter(StraightRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
    planner = Tracking(planner_of(limits, **settings), movers)
    return drive(planner, router, shield, [*static, *movers], goal, limits=limits, radius_m=RADIUS_M, duration_s=20.0)


@pytest.mark.parametrize("limits", [OMNI, DIFFERENTIAL], ids=["omni", "differential"])
@pytest.mark.parametrize(
    "movers",
    [
        [],
        [Disc(4.0, 0.1, 0.25, -0.5, 0.0)],
        [Disc(2.0, -1.2, 0.25, 0.0, 0.3)],
        [Disc(2.5, 1.2, 0.25, 0.0, -0.4), Disc(3.5, -1.2, 0.25, 0.0, 0.4)],
    ],
    ids=["nobody", "head-on", "crossing", "two crossing"],
)
def test_it_arrives_without_touching(movers, limits):
    trace = run(movers, (5.0, 0.0), limits)
    assert trace.reached(5.0, 0.0)
    assert trace.min_clearance_m > 0.03
    assert all(plan.base.vy == 0.0 for plan in trace.plans)


def test_it_does_not_commit_to_a_gap_that_closes():
    """A disc comes across the only opening; now it is free, and in the time that the robot needs it will not be."""
    gate = (*WALLS, Box(1.6, -1.5, 1.8, -0.45), Box(1.6, 0.45, 1.8, 1.5))
    mover = Disc(1.7 + 0.75, -1.1, 0.3, 0.0, 0.45)
    trace = run([mover], (4.5, 0.0), static=gate)
    assert trace.reached(4.5, 0.0)
    assert trace.min_clearance_m > 0.0


@pytest.mark.parametrize("yaw", [0.0, 0.15])
def test_a_gap_that_stays_narrow_is_not_dreaded(yaw):
    """Eight centimetres on either side, where fifteen are no risk: waiting does not widen them, and the way leads through."""
    gate = (*WALLS, Box(0.6, -1.5, 0.9, -0.33), Box(0.6, 0.33, 0.9, 1.5))
    assert planned(walls=gate, pose=SE2(0.1, 0.0, yaw)).base.vx > 0.4


def test_far_from_everybody_it_drives_fast_and_straight():
    plan = planned(twist=BodyTwist(0.6, 0.0, 0.0))
    assert plan.base.vx == pytest.approx(0.65)  # its full speed
    assert abs(plan.base.wz) < 0.25
    assert plan.latency_ns == 100_000_000


def test_the_tail_is_what_makes_it_careful():
    """Somebody comes towards it off the line; the mean of the risk is small, that of the tail is not."""
    oncoming = track(2.2, 0.75, -0.6, -0.05, variance=0.01)
    twist = BodyTwist(0.6, 0.0, 0.0)
    tail = planned(oncoming, twist=twist).diagnostics
    assert tail.cvar >= tail.mean_risk
    measures = {name: planner_of(risk={"measure": name}) for name in ("mean", "cvar", "worst")}
    risks = [planned(oncoming, planner=planner, twist=twist) for planner in measures.values()]
    assert risks[0].diagnostics.objective >= risks[1].diagnostics.objective >= risks[2].diagnostics.objective


@pytest.mark.parametrize(
    ("tracks", "warning"),
    [
        ((track(0.1, 0.0),), "an obstacle lies on the robot"),
        ((track(1.5, 0.0, variance=1e6),), "a track is too uncertain to say where its obstacle is"),
        ((track(math.nan, 0.0), track(3.0, 1.0)), "1 tracks are not finite and were left out"),
        ((track(1.5, 0.0, variance=math.inf),), "1 tracks are not finite and were left out"),
        ((track(1.5, 0.0, identity=0), track(1.5, 0.0, identity=1)), ""),
        ((), ""),
    ],
    ids=["on the robot", "uncertain", "not a number", "infinite covariance", "overlapping", "nobody"],
)
def test_bad_tracks_give_a_finite_command_and_word_of_them(tracks, warning):
    plan = planned(*tracks)
    assert plan.base.finite
    assert plan.diagnostics.warning == warning
    assert math.isfinite(plan.diagnostics.objective)


def test_with_somebody_on_it_it_does_not_press_on():
    for ahead in (0.1, 0.3, 0.45):
        assert planned(track(ahead, 0.0)).base.vx <= 0.0


def test_where_every_candidate_is_infeasible_it_takes_the_least_risk_and_says_so():
    ring = [track(0.55 * math.cos(a), 0.55 * math.sin(a), identity=i) for i, a in enumerate(np.arange(8) * math.pi / 4)]
    inward = [replace(t, velocity_in_odom=(-1.5 * t.position_in_odom[0], -1.5 * t.position_in_odom[1])) for t in ring]
    plan = planned(*inward)
    assert plan.diagnostics.stopped == "every candidate is infeasible"
    assert plan.diagnostics.free == 0
    assert plan.base.speed_m_s <= 0.1


@pytest.mark.parametrize("vx", [-0.8, 0.0])
@pytest.mark.parametrize("blocked", ["stand", "make_way"])
def test_while_the_way_is_blocked_it_makes_way_for_who_comes_where_the_setting_says_so(blocked, vx):
    belief = belief_with(track(1.6, 0.0, vx=vx))
    plan = planner_of(blocked=blocked).plan(belief, Route((6.0, 0.0), no_path(), 0.0, blocked=True))
    goes = blocked == "make_way" and vx < 0.0  # from who stands there it need not go
    assert (plan.base != STANDING) == goes
    assert plan.base.vx <= 0.0
    assert (plan.diagnostics.stopped == "the way is blocked") == (blocked == "stand")


@pytest.mark.parametrize(("gap_m", "speed"), [(0.06, 0.0), (0.35, 0.7)])
def test_it_brakes_for_a_wall(gap_m, speed):
    wall = (Box(RADIUS_M + gap_m, -1.5, 0.8, 1.5),)
    assert planned(walls=wall, twist=BodyTwist(speed, 0.0, 0.0)).base.vx <= 0.05


def test_cells_of_a_track_are_not_a_wall():
    """The grid holds the disc too; it goes with its track, and the way behind it is open."""
    walking = Disc(0.9, 0.0, 0.25, 1.2, 0.0)
    seen = track(0.9, 0.0, 1.2, 0.0)
    twist = BodyTwist(0.6, 0.0, 0.0)
    sure = planner_of(predictor="constant_velocity")
    assert planned(seen, walls=(walking,), twist=twist, planner=sure).base.vx > 0.4
    assert planned(walls=(Disc(0.9, 0.0, 0.25), Box(0.9, -1.5, 1.0, 1.5)), twist=twist).base.vx < 0.3


def test_never_seen_ground_is_braked_for_where_the_setting_says_so():
    options = {"walls": (), "twist": BodyTwist(0.5, 0.0, 0.0), "seen_m": 0.4}
    cautious, bold = planned(**options), planned(planner=planner_of(stop_before_unknown=False), **options)
    assert cautious.path_in_odom[-1, 0] < 0.45
    assert bold.path_in_odom[-1, 0] > 1.0


@pytest.mark.parametrize("budget_ns", [0, 1, 400_000])
def test_without_time_for_a_scenario_it_stands_and_says_so(budget_ns):
    belief = belief_with(track(2.0, 0.0))
    plan = planner_of().plan_within(belief, straight(belief), budget_ns)
    assert plan.base == BodyTwist()
    assert plan.diagnostics.stopped == "there is no time for any scenario"


def test_a_count_from_a_budget_gives_the_commands_of_the_same_count_fixed():
    hurried, fixed = planner_of(), planner_of(budget={"scenarios": 64})
    assert isinstance(hurried, Anytime)
    for tick in range(1, 15):
        belief = belief_with(track(2.0 - 0.02 * tick, 0.2, -0.4), track(3.0, -0.5, 0.0, 0.2, identity=4), tick=tick)
        one, other = hurried.plan_within(belief, straight(belief), 860_000), fixed.plan(belief, straight(belief))
        assert one.diagnostics.scenarios == other.diagnostics.scenarios == 64
        assert one.base == other.base
        assert facts(one.path_in_odom) == facts(other.path_in_odom)
        assert one.diagnostics.bound == other.diagnostics.bound


def test_the_count_grows_with_the_budget_to_the_most_there_may_be():
    settings, distances = Rcsp.Settings().budget, 165 * 25 * 6
    counts = [affordable(settings, ms * 100_000, distances, reacting=False) for ms in range(60)]
    assert counts == sorted(counts)
    assert counts[0] == 0
    assert counts[-1] == 128
    assert all(count % 8 == 0 for count in counts)
    assert affordable(settings, 10_000_000, 0, reacting=False) == 128
    assert affordable(settings, 3_000_000, distances, reacting=True) < affordable(settings, 3_000_000, distances, reacting=False)


def test_the_bound_shrinks_with_the_scenarios():
    few, many = (planned(track(2.0, 0.0), planner=planner_of(budget={"scenarios": n})).diagnostics.bound for n in (100, 400))
    assert few / many == pytest.approx(2.0)


def test_nothing_is_compiled_after_warm_up_with_somebody_there():
    for settings in ({}, {"reaction": "candidate"}, {"predictor": "random_walk"}, {"prediction": {"per_obstacle": True}}):
        planner, router = planner_of(**settings), StraightRouter(StraightRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
        beliefs = [belief_with(*(track(2.0 + i, 0.2, identity=i) for i in range(tick % 3)), tick=tick) for tick in range(1, 8)]
        routes = [router.route(belief, mission_to(6.0, 0.0)) for belief in beliefs]
        forget_kernels()
        planner.warm_up()
        ready = signatures()
        for belief, route in zip(beliefs, routes, strict=True):
            planner.plan(belief, route)
            planner.restore(planner.snapshot())
        assert signatures() - ready == set()


@pytest.mark.parametrize(
    "settings",
    [{}, {"prediction": {"per_obstacle": True}}, {"reaction": "candidate"}, {"predictor": "constant_velocity"}],
    ids=["joint", "per obstacle", "reacting", "constant velocity"],
)
def test_a_restored_one_continues_identically_among_tracks(settings):
    beliefs = [belief_with(track(3.0 - 0.03 * k, 0.2, -0.6), track(2.0, -0.5, identity=k // 5), tick=k) for k in range(1, 20)]
    first, second = planner_of(**settings), planner_of(**settings)
    for belief in beliefs[:9]:
        first.plan(belief, straight(belief))
    second.restore(first.snapshot())
    for belief in beliefs[9:]:
        assert facts(first.plan(belief, straight(belief))) == facts(second.plan(belief, straight(belief)))


def test_who_reacts_does_so_to_how_the_robot_drives_and_not_to_what_it_asked_for():
    """Else they would chase the last choice, the other one would look free of them, and the next choice would be that one."""
    driving, ahead, futures = BodyTwist(0.5, 0.0, 0.0), [Box(1.0, -1.5, 1.2, 1.5)], []
    for walls in ([], ahead):
        planner = planner_of(prediction={"family": ["aggressive"]})
        asked = planned(planner=planner, walls=(*WALLS, *walls), twist=driving)
        told = planned(track(1.6, 1.2, 0.0, -0.6), planner=planner, twist=driving, tick=2)
        futures.append((asked.base.vx, {one.name: one.points_in_odom for one in told.drawings if one.name.startswith("future")}))
    (free_m_s, one), (blocked_m_s, other) = futures
    assert free_m_s > blocked_m_s + 0.1
    assert one.keys() == other.keys() != set()
    for name, points in one.items():
        np.testing.assert_allclose(points, other[name], atol=0.01)  # the last command is still under way for a moment


def test_the_layers_show_candidates_futures_and_where_it_would_commit():
    drawings = {d.name: d.points_in_odom for d in planned(track(1.6, 0.0, -0.5), twist=BodyTwist(0.6, 0.0, 0.0)).drawings}
    groups = [len(points) for name, points in drawings.items() if name.startswith("candidates_")]
    assert sum(groups) == 165
    assert sum(len(points) for name, points in drawings.items() if name.startswith("futures_")) == 16 * 5
    (point,) = drawings["commitment"]
    assert 0.0 <= point[0] < 1.6


@pytest.mark.parametrize("kind", [INVERSE_CLEARANCE, VIOLATION, NEAR_MISS])
def test_risk_falls_with_clearance_and_is_bounded(kind):
    risk = Risk(kind, 0.4, 3.0, 0.3)
    values = [risk_of(c, 0.4, risk) for c in np.linspace(-1.0, 1.0, 401)]
    assert all(a >= b for a, b in pairwise(values))
    assert values[0] == largest(risk, 0.4)
    assert values[-1] == 0.0
    assert risk_of(-0.01, 0.4, risk) > risk_of(0.01, 0.4, risk)
    at_once, places = np.empty(401), np.linspace(-1.0, 1.0, 401, dtype=np.float32)
    risks_of(places, 0.4, risk, at_once)
    assert at_once.tolist() == [risk_of(c, 0.4, risk) for c in places]


def test_clearances_are_those_of_a_brute_force():
    rng = np.random.default_rng(3)
    x, y = (rng.uniform(-2.0, 2.0, (7, 9)).astype(np.float32) for _ in range(2))
    futures = rng.uniform(-2.0, 2.0, (9, 3, 2, 20)).astype(np.float32)
    contact = np.array([0.3, 0.5, 0.7], np.float32)
    found = clearances(x[:, :7].copy(), y[:, :7].copy(), np.stack((x[:, 8], y[:, 8]), axis=1), futures, contact, 1.0)
    x[:, 7:], y[:, 7:] = x[:, 8:], y[:, 8:]  # after seven steps it stands
    apart = np.hypot(futures[None, :, :, 0] - x[:, :, None, None], futures[None, :, :, 1] - y[:, :, None, None])
    apart = apart - contact[:, None]
    apart[:, 7:] = np.maximum(apart[:, 7:], 0.0)
    expected = np.minimum(apart.min(axis=(1, 2)), 1.0)
    assert found == pytest.approx(expected, abs=1e-5)
    assert (expected == 0.0).any()


def test_standing_in_somebody_s_way_after_the_horizon_is_a_near_miss():
    at = np.array([[0.0, 0.0], [0.0, 2.0], [0.0, 0.7]], np.float32)
    futures = np.array([[-1.0, -0.2, 0.6], [0.0, 0.0, 0.0]], np.float32).T.reshape(3, 1, 2, 1)  # (steps, 1, 2, 1): past the first
    contact, elsewhere = np.array([0.5], np.float32), np.full((3, 3), 9.0, np.float32)
    before, after = np.full((3, 1, 2, 1), -9.0, np.float32), np.concatenate((np.full((3, 1, 2, 1), -9.0, np.float32), futures))
    expected = [0.0, 0.4, math.hypot(0.2, 0.7) - 0.5]
    assert clearances(elsewhere, elsewhere, at, after, contact, 0.4)[:, 0] == pytest.approx(expected)
    x, y = (np.repeat(at[:, axis : axis + 1], 3, axis=1) for axis in range(2))  # under way, not at rest
    under_way = clearances(x, y, elsewhere[:, :2].copy(), np.concatenate((futures, before)), contact, 0.4)
    assert under_way[:, 0] == pytest.approx([-0.3, *expected[1:]])


def evaluation_of(*commands):
    """What came of a hundred scenarios; each command is clearances and how many scenarios have them."""
    clearance = np.array([[c for c, times in command for _ in range(times)] for command in commands], np.float32)
    count, n = clearance.shape
    room_m, brakable, risk = np.ones(count, np.float32), np.ones(count, np.bool_), Risk(NEAR_MISS, 0.4, 3.0, 0.3)
    told = tails(clearance, room_m, brakable, 10, risk, 0.15)
    nobody = Futures(np.zeros((1, 0, 2, n), np.float32), np.zeros(0), np.zeros((0, n), np.int64))
    return Evaluation(-told[0], np.zeros(count), told[0], told[1], told[2], clearance, room_m, brakable, risk, nobody, 10, 0.15)


def test_where_every_tail_touches_somebody_the_less_likely_collision_is_taken():
    likely, deeper = [(-0.1, 90), (0.5, 10)], [(-0.2, 20), (0.5, 80)]
    told = evaluation_of(likely, deeper)
    assert told.risk[0] < told.risk[1]
    np.testing.assert_allclose(told.mean_risks(slice(None)), [0.9 * (4.0 + 1 / 3), 0.2 * (4.0 + 2 / 3)], rtol=1e-6)
    assert told.best(np.zeros(2)) == (1, False)


def test_where_every_tail_touches_somebody_a_trap_counts_for_half_a_collision():
    into_a_trap, past = [(-0.1, 10), (0.0, 90)], [(-0.1, 40), (0.5, 60)]
    told = evaluation_of(into_a_trap, past)
    np.testing.assert_allclose(told.mean_risks(slice(1)), 0.1 * (4.0 + 1 / 3) + 0.9 * 2.5, rtol=1e-5)
    assert told.best(np.zeros(2)) == (1, False)


def test_a_command_that_leads_to_where_somebody_comes_is_not_free():
    trap, near = [(0.0, 10), (0.5, 90)], [(0.01, 90), (0.5, 10)]
    told = evaluation_of(trap, near, [(0.0, 9), (0.5, 91)])
    assert told.free.tolist() == [False, True, True]


def test_it_does_not_flee_along_the_way_of_who_comes_after_it():
    """Somebody crosses before it; turning away and driving ahead of him is free for 2.5 s, and leads to where he comes."""
    plan = planned(track(1.3, -1.6, 0.0, 0.7, radius=0.3), twist=BodyTwist(0.4, 0.0, 0.0))
    end = plan.path_in_odom[-1]
    assert abs(end[1]) < 0.5


def test_way_to_go_is_along_the_route_plus_what_is_beside_it():
    path, along = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]]), np.array([0.0, 2.0, 4.0])
    x, y, yaw = (np.array(v, np.float32) for v in ([0.5, 0.5, 2.0], [0.0, 0.3, 1.0], [0.0, 0.0, math.pi / 2]))
    left = to_go(x, y, yaw, path, along, 0.5, 0.0, 0.5)
    assert left == pytest.approx([3.5, 3.65, 1.0], abs=1e-6)
    facing = to_go(x[:1], y[:1], yaw[:1] + np.float32(math.pi), path, along, 0.5, 0.1, 0.5)
    assert facing == pytest.approx([3.5 + 0.1 * math.pi], abs=1e-5)


def test_a_robot_without_a_base_is_refused():
    with pytest.raises(ConfigurationError, match=r"planner.name 'rcsp'"):
        Rcsp(Rcsp.Settings(), PlannerSetup(PERIOD_S, RADIUS_M, None, 0))
