"""The clearance-manifold planner: what it continues, when it falls back, how well it tracks, and what it does with bad input."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from estimators.belief import OCCUPIED, UNKNOWN
from planners.clearance_manifold.controller import APPROACH
from planners.clearance_manifold.planner import ClearanceManifold
from planners.clearance_manifold.settings import ClearanceManifoldSettings
from planners.planner import PlannerSetup, no_path
from planners.router import Route, RouterSetup
from planners.routers.straight import StraightRouter
from tests.planners.synthetic import DIFFERENTIAL, OMNI, Box, Disc, belief_of, mission_to

PERIOD_S, RADIUS_M = 0.05, 0.12
WALLS = (Box(-4, 1.0, 12, 1.2), Box(-4, -1.2, 12, -1.0))
STRAIGHT = StraightRouter(StraightRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))


def planner_of(limits=OMNI, **settings):
    return ClearanceManifold(ClearanceManifoldSettings(**settings), PlannerSetup(PERIOD_S, RADIUS_M, limits, 0))


def at(tick, obstacles=WALLS, pose=SE2(), twist=BodyTwist(), **kwargs):  # noqa: B008 - frozen
    belief = belief_of(obstacles, pose, twist, tick=tick, **kwargs)
    return replace(belief, stamp_ns=tick * 50_000_000)


def routed(belief, goal=(9.0, 0.0)):
    return belief, STRAIGHT.route(belief, mission_to(*goal))


def said(planner, belief, goal=(9.0, 0.0)):
    return planner.plan(*routed(belief, goal)).diagnostics


def test_a_still_corridor_is_continued_with_all_properties():
    planner = planner_of()
    told = [said(planner, at(k, pose=SE2(0.025 * k, 0.0, 0.0), twist=BodyTwist(0.5, 0.0, 0.0))) for k in range(12)]
    assert told[0].fallback_category == "cold_start"
    assert {d.fallback_category for d in told[1:]} == {"none"}
    assert all((d.p1, d.p2, d.p3, d.p4, d.p5, d.p6) == (True,) * 6 for d in told[1:])
    assert told[-1].deviation_m < 0.02
    assert told[-1].utilisation == pytest.approx(11 / 12)
    assert told[-1].speed_m_s == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("change", "category", "trigger"),
    [
        ({"goal": (5.0, 0.2)}, "task_reset", "goal changed"),
        ({"pose": SE2(1.2, 0.0, 0.0)}, "sensing_failure", "pose jump"),
        ({"pose": SE2(0.0, 0.45, 0.0)}, "sensing_failure", "lateral drift"),
        ({"obstacles": (*WALLS, Box(0.3, -1.0, 0.5, 0.35))}, "regular_continuation_failure", "tube collapsed"),
    ],
)
def test_what_breaks_the_continuation_is_named(change, category, trigger):
    planner = planner_of()
    for tick in range(3):
        said(planner, at(tick))
    goal = change.pop("goal", (9.0, 0.0))
    told = said(planner, at(3, **change), goal)
    assert (told.fallback_category, told.trigger) == (category, trigger)
    assert said(planner, at(4, **change), goal).fallback_category == "none"  # and it goes on from there


def test_a_base_that_looked_aside_for_long_backs_off_until_it_sees_what_is_right_before_it():
    """Turned by 90 degrees for 5 s, then ahead again: what has come within the near end of its view it cannot know of."""
    planner, pose = planner_of(lookout={"enabled": False}, prediction={"fov_deg": 87.0}), SE2()
    for tick in range(40):
        planner.plan(*routed(at(tick)))
    for tick in range(40, 140):
        planner.plan(*routed(at(tick, pose=SE2(0.0, 0.0, 0.5 * math.pi))))
    way = []
    for tick in range(140, 260):
        twist = planner.plan(*routed(at(tick, pose=pose))).base
        pose = pose.integrate(twist.vx, twist.vy, 0.0, PERIOD_S)
        way.append(pose.x)
    near_m, stood_m = 0.46, 0.2
    assert min(way) == pytest.approx(stood_m - near_m, abs=0.1)  # until it sees where it stood
    assert way[-1] > 0.3  # and then it goes


def test_another_branch_is_taken_when_it_was_better_for_long_enough(monkeypatch):
    planner, better, looks = planner_of(), [False], []
    monkeypatch.setattr(planner._tracker._solver, "better", lambda *_: looks.append(better[0]) or better[0])
    triggers = [said(planner, at(0)).trigger]
    for tick in range(1, 80):
        better[0] = len(looks) in (1, 2) or len(looks) >= 4  # for 0.2 s, and later for good
        triggers.append(said(planner, at(tick)).trigger)
    taken = [tick for tick in range(1, 80) if triggers[tick] == "better branch"]
    assert looks[:7] == [False, True, True, False, True, True, True]
    first = taken[0] * PERIOD_S
    assert first == pytest.approx(0.6 + 0.6 + 0.2 + 0.2 + 0.6 + 0.4)  # doubted at the fifth look, it looks every 0.2 s


def test_a_branch_that_leads_the_same_way_is_no_other_one(monkeypatch):
    planner, scenes = planner_of(), []
    solver, pillar = planner._tracker._solver, Disc(2.0, 0.0, 0.2)
    monkeypatch.setattr(solver, "better", lambda scene, *_: scenes.append(scene) or False)
    for tick in range(14):
        planner.plan(*routed(at(tick, (*WALLS, pillar))))
    monkeypatch.undo()
    followed = planner._tracker._offset_m
    side = math.copysign(0.6, followed[np.argmax(np.abs(followed))])
    for y, other in ((side, False), (-side, True)):
        wanted = np.full(scenes[-1].end - solver.own, y)
        monkeypatch.setattr(solver, "branch", lambda *_, wanted=wanted: (wanted, 1.0))
        assert solver.better(scenes[-1], followed, 10) == other


def test_a_station_has_room_before_the_robot_is_there_and_is_the_slower_to_get_it_the_farther_it_is():
    planner = planner_of()
    planner.plan(*routed(at(0)))
    solver, away_m, period_s = planner._tracker._solver, np.full(21, 0.3), 0.05
    scene = planner._scene(planner._chart, planner._field.update(at(1)), at(1), np.zeros(2))
    step_m, arcs_m = solver._towards(away_m, scene), planner._stations.arcs_m
    rest = (1.0 - step_m / away_m) ** (arcs_m / 0.4 / period_s)  # of what was missing, when the robot is there at 0.4 m/s
    assert (rest[arcs_m > 0.5] < math.exp(-2.4)).all()
    assert (np.diff(step_m[solver.own :]) <= 0.0).all()
    assert step_m.max() == pytest.approx(0.5 * period_s)  # L
    assert not solver._towards(np.array([-0.1, np.nan] * 10 + [0.0]), scene).any()


ALONG_X_M = np.arange(0.0, 9.0, 0.05)
STRAIGHT_ON = np.stack((ALONG_X_M, 0.0 * ALONG_X_M), axis=1)
ASIDE = np.stack((ALONG_X_M, 0.95 * np.sin(np.clip(ALONG_X_M, 0.0, 3.0) * math.pi / 3.0)), axis=1)


def first_laid_anew(planner, aside):
    """Return the first tick with another chart than before, where the route leads aside in the ticks of which `aside` says so."""
    charts = []
    for tick in range(60):
        planner.plan(at(tick), Route((9.0, 0.0), ASIDE if aside(tick) else STRAIGHT_ON, 9.0))
        charts.append(planner._chart)
    return next(tick for tick in range(1, 60) if charts[tick] is not charts[tick - 1])


def test_a_route_that_leaves_the_chart_for_a_moment_does_not_bend_it():
    planner = planner_of()
    laid = first_laid_anew(planner, lambda tick: 10 <= tick < 20 or tick >= 30)
    assert laid == 30 + round(planner.Settings().chart.escape_s / PERIOD_S)


def test_a_route_around_who_closes_in_does_not_bend_the_chart_before_he_is_gone(monkeypatch):
    planner = planner_of()
    update, crosses = planner._field.update, np.array([[3.0, -1.5, -0.5, 0.5, 20.0]] + 2 * [5 * [0.0]])

    def seen(belief):
        return replace(update(belief), closing=crosses if belief.stamp_ns < 40 * 50_000_000 else np.zeros((3, 5)))

    monkeypatch.setattr(planner._field, "update", seen)
    laid = first_laid_anew(planner, lambda tick: tick >= 10)
    assert laid == 40 + round(planner.Settings().chart.escape_s / PERIOD_S)


def test_without_continuation_every_tick_is_a_failure_to_continue():
    planner = planner_of(tracker={"enabled": False})
    told = [said(planner, at(tick)) for tick in range(4)]
    assert [d.tracking for d in told] == [False] * 4
    assert told[-1].fallback_category == "regular_continuation_failure"


def test_the_manifold_goes_around_what_stands_in_the_way_and_stays_in_the_box():
    planner = planner_of()
    plan = planner.plan(*routed(at(0, (*WALLS, Disc(2.0, 0.2, 0.3)))))
    path = plan.path_in_odom
    gap = np.minimum(np.hypot(path[:, 0] - 2.0, path[:, 1] - 0.2) - 0.3, 1.0 - np.abs(path[:, 1]))
    assert gap[path[:, 0] < 2.9].min() >= 0.2 - 0.03
    drawn = {drawing.name for drawing in plan.drawings}
    assert drawn == {"centre_line", "manifold", "ridge", "box_left", "box_right", "tube_left", "tube_right"}


@pytest.mark.parametrize("smooth", [False, True])
def test_tracking_error_keeps_the_bound_on_a_moving_manifold(smooth):
    """Proposition 2: |e| <= exp(-k t) |e0| + sup v / k, on a corridor that moves sideways.

    With limited jerk j the robot drives towards it with at most (c j e^2)^(1/3): as fast as v from e = (v^3 / c j)^(1/2).
    """
    planner, gain, sideways = planner_of(smoothness={"enabled": smooth}), 4.0, 0.15
    pose, error0, worst = SE2(0.0, -0.2, 0.0), None, 0.0
    for tick in range(80):
        shift = sideways * tick * PERIOD_S
        walls = (Box(-4, 1.0 + shift, 12, 1.2 + shift), Box(-4, -1.2 + shift, 12, -1.0 + shift))
        plan = planner.plan(*routed(at(tick, walls, pose, BodyTwist(0.4, 0.0, 0.0)), (9.0, 0.0)))
        told, twist = plan.diagnostics, plan.base
        worst = max(worst, told.bound_m) if tick > 1 else worst
        error0 = told.error_m if error0 is None else error0
        speed = gain * worst
        lasting = max(worst, math.sqrt(speed**3 / (APPROACH * 3.0))) if smooth else worst
        assert told.error_m <= math.exp(-gain * tick * PERIOD_S) * error0 + lasting + PERIOD_S * speed + 0.01
        pose = pose.integrate(twist.vx, twist.vy, twist.wz, PERIOD_S)


def test_a_differential_base_ends_up_on_the_manifold():
    """The point ahead of it keeps the bound; the centre is never farther off than that point's error and its distance."""
    planner, pose, twist = planner_of(DIFFERENTIAL), SE2(0.0, -0.3, 0.3), BodyTwist()
    ahead_m = ClearanceManifoldSettings().controller.look_ahead_m
    walls = (Box(-4, 0.6, 12, 1.2), Box(-4, -1.2, 12, -0.6))
    for tick in range(120):
        plan = planner.plan(*routed(at(tick, walls, pose, twist)))
        twist = plan.base
        assert twist.vy == 0.0
        point = np.array([pose.x, pose.y]) + ahead_m * np.array([math.cos(pose.yaw), math.sin(pose.yaw)])
        offset = np.interp(point[0], *plan.path_in_odom.T)
        centre = np.interp(pose.x, *plan.path_in_odom.T)
        assert abs(pose.y - centre) <= abs(point[1] - offset) + ahead_m + 0.02
        pose = pose.integrate(twist.vx, 0.0, twist.wz, PERIOD_S)
    assert abs(pose.y) < 0.05
    assert pose.x > 1.5


def test_a_restored_planner_goes_on_identically():
    def inputs(tick):
        return routed(at(tick, (*WALLS, Disc(3.0 - 0.04 * tick, 0.3, 0.25, -0.8, 0.0)), SE2(0.02 * tick, 0.0, 0.0)))

    one, other = planner_of(), planner_of()
    for tick in range(15):
        one.plan(*inputs(tick))
    for tick in range(3):
        other.plan(*inputs(30 + tick))
    other.restore(one.snapshot())
    for tick in range(15, 30):
        first, second = one.plan(*inputs(tick)), other.plan(*inputs(tick))
        assert first.base == second.base
        assert first.diagnostics == second.diagnostics
        assert first.path_in_odom.tobytes() == second.path_in_odom.tobytes()


def filled(belief, label):
    known = np.full(belief.grid.label.shape, label != UNKNOWN)
    clearance = np.full(known.shape, 0.0 if label == OCCUPIED else 6.0, np.float32)
    grid = replace(belief.grid, label=np.full(known.shape, label, np.uint8))
    return replace(belief, grid=grid, clearance=replace(belief.clearance, clearance_m=clearance, known=known, overlap=known))


@pytest.mark.parametrize("limits", [OMNI, DIFFERENTIAL], ids=["omni", "differential"])
@pytest.mark.parametrize(
    ("belief", "goal", "reason"),
    [
        (at(0, (Disc(0.0, 0.0, 0.5),)), (9.0, 0.0), "inside an obstacle"),
        (filled(at(0), OCCUPIED), (9.0, 0.0), "inside an obstacle"),
        (filled(at(0), UNKNOWN), (9.0, 0.0), ""),
        (at(0, (Box(-4, 0.03, 12, 1.2), Box(-4, -1.2, 12, -0.03))), (9.0, 0.0), "no passage is wide enough here"),
        (at(0, (Box(0.28, -3, 3, 3),)), (2.0, 0.0), ""),  # the goal lies in a wall right ahead
    ],
    ids=["inside", "all occupied", "all unknown", "one cell wide", "goal in a wall"],
)
def test_stands_where_there_is_no_safe_way(limits, belief, goal, reason):
    planner = planner_of(limits)
    plan = planner.plan(*routed(belief, goal))
    assert plan.base.finite
    assert plan.base.vx <= 0.02
    assert plan.diagnostics.speed_m_s <= 0.02
    assert plan.diagnostics.p6
    assert reason in plan.diagnostics.stopped


@pytest.mark.parametrize("blocked", [True, False])
def test_refuses_without_a_route(blocked):
    plan = planner_of().plan(at(0), Route(None if not blocked else (3.0, 0.0), no_path(), 0.0, blocked))
    assert plan.base == BodyTwist()
    assert plan.diagnostics.stopped == ("the way is blocked" if blocked else "no goal")


@pytest.mark.parametrize("limits", [OMNI, DIFFERENTIAL], ids=["omni", "differential"])
def test_turns_to_a_goal_behind_before_it_drives_into_what_it_has_not_seen(limits):
    planner, pose, twist = planner_of(limits), SE2(), BodyTwist()
    for tick in range(200):
        belief = at(tick, (), pose, twist, fov_rad=math.radians(87.0))
        twist = planner.plan(*routed(belief, (-3.0, 0.02))).base
        if abs(pose.yaw) < math.pi / 2:
            assert math.hypot(pose.x, pose.y) < 0.3
        pose = pose.integrate(twist.vx, twist.vy, twist.wz, PERIOD_S)
    assert pose.x < -1.0


def test_an_empty_grid_is_no_obstacle():
    planner, twist = planner_of(), BodyTwist()
    for tick in range(40):
        plan = planner.plan(*routed(at(tick, (), twist=twist)))
        twist = plan.base
    assert plan.base.vx > 0.45
    assert plan.diagnostics.p1


def test_gives_way_behind_who_crosses_instead_of_driving_in_front():
    """A walker crosses from the right, well ahead: standing would let him pass; going left would meet him."""
    crossing = Disc(1.57, -1.07, 0.25, -0.6, 0.6)  # at the tenth tick at (1.3, -0.8)
    at_once = {"enabled": False}
    yields, stubborn = planner_of(smoothness=at_once), planner_of(smoothness=at_once, controller={"yield_m": 0.0})
    asked = [
        [planner.plan(*routed(at(tick, (*WALLS, crossing.at(tick * PERIOD_S))))).base for tick in range(10)][-1]
        for planner in (yields, stubborn)
    ]
    assert (
        asked[0].vx + asked[0].vy < 0.0 < asked[1].vx + asked[1].vy
    )  # along the miss vector, which points ahead and to the left


@pytest.mark.parametrize(
    "path",
    [np.zeros((1, 2)), np.zeros((4, 2)), np.array([[0.0, 0.0], [0.0, 1e-9], [2.0, 0.0]])],
    ids=["point", "standing", "double"],
)
def test_a_route_without_a_corridor_to_lay_leads_straight_to_the_goal_or_nowhere(path):
    planner = planner_of()
    for tick in range(3):
        plan = planner.plan(at(tick), Route((2.0, 0.0), path, 2.0))
        assert plan.base.finite
        assert plan.diagnostics.p6
        assert abs(plan.base.vy) < 0.05
    assert np.abs(plan.path_in_odom[:, 1]).max() < 0.1
