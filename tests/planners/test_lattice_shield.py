"""The lattice filter: what is safe passes unchanged, what is not is replaced inside what can be reached."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.samples import frozen_array
from estimators.belief import Track
from planners.planner import PlannerSetup
from planners.point_ds.planner import PointAttractor
from planners.router import RouterSetup
from planners.routers.straight import StraightRouter
from planners.shield import ShieldSetup
from planners.shields.lattice import LatticeShield
from planners.shields.lattice_answer_kernels import Answer
from planners.shields.lattice_kernels import Local, forecast
from tests.planners.synthetic import DIFFERENTIAL, OMNI, Box, Disc, belief_of, command_of, drive, reachable_from

PERIOD_S, RADIUS_M = 0.05, 0.25
AHEAD = BodyTwist(0.5, 0.0, 0.0)


def shield_of(limits=DIFFERENTIAL, **settings):
    return LatticeShield(LatticeShield.Settings.model_validate(settings), ShieldSetup(PERIOD_S, RADIUS_M, limits))


def filtered(obstacles, asked=AHEAD, twist=AHEAD, limits=DIFFERENTIAL, tracks=(), **settings):
    belief = replace(belief_of(obstacles, twist=twist), tracks=tracks)
    return shield_of(limits, **settings).filter(command_of(asked), belief, reachable_from(twist, limits, PERIOD_S))


def coming(x, vx, radius=0.25):
    return Track(0, (x, 0.0), (vx, 0.0), radius, frozen_array(np.zeros((4, 4))))


@pytest.mark.parametrize("limits", [DIFFERENTIAL, OMNI], ids=["differential", "omni"])
@pytest.mark.parametrize("asked", [AHEAD, BodyTwist(0.5, 0.0, 0.15), BodyTwist()])
def test_what_is_safe_passes_unchanged(asked, limits):
    result = filtered([Disc(4.0, 0.0, 0.25)], asked, limits=limits)
    assert result.command.base == reachable_from(AHEAD, limits, PERIOD_S).clip(asked)
    assert result.diagnostics.asked_feasible


@pytest.mark.parametrize("limits", [DIFFERENTIAL, OMNI], ids=["differential", "omni"])
def test_it_brakes_or_turns_before_a_wall(limits):
    result = filtered([Box(0.6, -3, 1.0, 3)], limits=limits)
    assert result.intervened
    assert not result.diagnostics.asked_feasible
    assert result.command.base.vx < 0.5


def test_who_wants_to_stop_may_although_what_he_gets_to_in_a_tick_would_not_do():
    """The wall is 0.45 m off: the speed that is left after one tick, kept up, leads into it; braking on does not."""
    result = filtered([Box(RADIUS_M + 0.45, -3, 3.0, 3)], asked=BodyTwist())
    assert result.diagnostics.asked_feasible
    assert not result.intervened
    assert result.command.base == reachable_from(AHEAD, DIFFERENTIAL, PERIOD_S).clip(BodyTwist())


def test_it_sees_by_its_velocity_who_will_be_in_the_way():
    assert filtered([], tracks=(coming(1.6, 0.5),)).diagnostics.asked_feasible
    assert not filtered([], tracks=(coming(1.6, -0.8),)).diagnostics.asked_feasible


def test_the_cells_of_a_track_go_with_it():
    """A disc that drives ahead of the robot as fast as the robot is no wall."""
    obstacle = Disc(0.8, 0.0, 0.25, 0.6, 0.0)
    assert filtered([obstacle], tracks=(coming(0.8, 0.6),)).diagnostics.asked_feasible
    assert not filtered([obstacle]).diagnostics.asked_feasible


def test_of_the_margin_a_rollout_takes_no_more_than_its_share():
    """It drives 0.6 m of the way to a wall 0.9 m off; a gain of 0.6 would allow 0.51 m."""
    wall = [Box(RADIUS_M + 0.9, -3, 3.0, 3)]
    assert filtered(wall, gain=1.0).diagnostics.asked_feasible
    assert not filtered(wall, gain=0.6).diagnostics.asked_feasible


@pytest.mark.parametrize("limits", [DIFFERENTIAL, OMNI], ids=["differential", "omni"])
@pytest.mark.parametrize(
    "obstacles",
    [[Box(-9, -9, 9, 9)], [Disc(0.1, 0.0, 0.2)], [Disc(0.3, 0.0, 0.2), Disc(-0.3, 0.0, 0.2)]],
    ids=["walled in", "on it", "wedged"],
)
def test_where_nothing_is_feasible_it_says_so_and_does_not_press_on(obstacles, limits):
    result = filtered(obstacles, twist=BodyTwist(), limits=limits)
    assert result.diagnostics.infeasible
    assert result.diagnostics.enclosed
    assert result.command.base.vx <= 0.0
    assert result.command.base.finite


def test_a_track_that_is_not_finite_is_left_out():
    assert filtered([], tracks=(coming(math.nan, 0.0), coming(1.0, math.inf))).command.base.finite


def test_a_planner_that_sees_nothing_does_not_collide_under_it():
    setup = PlannerSetup(PERIOD_S, RADIUS_M, OMNI, 0)
    planner = PointAttractor(PointAttractor.Settings(), setup)
    router = StraightRouter(StraightRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
    trace = drive(planner, router, shield_of(OMNI), [Disc(1.5, 0.02, 0.3)], (3.0, 0.0), radius_m=RADIUS_M, duration_s=12.0)
    assert trace.min_clearance_m > 0.0
    assert trace.poses[-1].x > 0.5


def driven_from_rest(response_s):
    """Return where half a metre per second asked of a standing base, 1 m/s^2 after 0.3 s of latency, leads in 2.3 s, (2,)."""
    answer = Answer(np.ones(3), 0.3, response_s, 0.001, 2000, 0.1, 1)
    nobody, alone = np.zeros((2003, 0, 2), np.float32), np.zeros(0)
    local = Local(np.full((3, 3), 9.0, np.float32), -1.0, -1.0, 1.0, nobody, alone, 0.2, 5.0)
    _, end, here = forecast(np.zeros(3), np.zeros(3), np.zeros(3), np.array([[0.5, 0.0, 0.0]]), answer, local)
    assert here == 5.0
    return end[0]


def test_the_forecast_is_the_motion_of_a_base_that_answers_late():
    """0.125 m while speeding up, then 0.5 m/s; a lag of T keeps it T seconds of its speed behind."""
    assert driven_from_rest(0.0) == pytest.approx([0.125 + 0.5 * 1.5, 0.0], abs=1e-3)
    assert driven_from_rest(0.1) == pytest.approx([0.125 + 0.5 * 1.5 - 0.5 * 0.1, 0.0], abs=1e-3)


def test_to_run_ahead_of_somebody_faster_is_no_way_out():
    """He is 1.1 m behind and 0.5 m/s faster: after 1.3 s there is room, after 2.5 s there is none, stopping or not."""
    behind = (coming(-1.6, 1.0),)
    assert filtered([], tracks=behind, after_s=0.1).diagnostics.asked_feasible
    assert not filtered([], tracks=behind).diagnostics.asked_feasible


def test_a_twist_that_can_be_stopped_afterwards_is_safe_before_a_wall():
    """Kept up it meets the wall 1.1 m off after 2.3 s, but nothing keeps it from stopping then."""
    assert filtered([Box(RADIUS_M + 1.1, -3, 3.0, 3)]).diagnostics.asked_feasible


def test_nobody_comes_through_a_wall():
    across, wall = Track(0, (0.5, 1.3), (0.0, -0.7), 0.25, frozen_array(np.zeros((4, 4)))), Box(-2, 0.6, 2, 0.7)
    assert not filtered([], BodyTwist(), BodyTwist(), tracks=(across,)).diagnostics.asked_feasible
    assert filtered([wall], BodyTwist(), BodyTwist(), tracks=(across,)).diagnostics.asked_feasible


def after_he_came(shield, came_m, rested_s, tracked_s=9.0):
    """Filter while somebody comes at 0.7 m/s to 0.4 m before a robot that stands, seen for so long, and rests there."""
    last_m = 2 * RADIUS_M + 0.4
    ticks = [*np.arange(came_m, 0.0, -0.7 * PERIOD_S), *np.zeros(round(rested_s / PERIOD_S))]
    for k, off_m in enumerate(ticks):
        him = coming(last_m + off_m, -0.7 if off_m > 0.0 else 0.0)
        belief = belief_of([Disc(last_m + off_m, 0.0, 0.25)], size_m=3.0, cell_m=0.1)
        stood_s = (k - np.count_nonzero(np.array(ticks) > 0.0)) * PERIOD_S
        belief = replace(belief, tracks=(him,) if stood_s < tracked_s else (), stamp_ns=round(k * PERIOD_S * 1e9))
        result = shield.filter(command_of(BodyTwist()), belief, reachable_from(BodyTwist(), DIFFERENTIAL, PERIOD_S))
    return result


def test_out_of_the_way_of_who_came_and_stopped_as_he_may_go_on():
    for tracked_s in (9.0, 0.1):  # a tracker may take him for a part of the grid
        result = after_he_came(shield_of(), 0.6, 0.3, tracked_s)
        assert not result.diagnostics.asked_feasible
        assert result.command.base.vx < 0.0


def test_who_stopped_before_a_wall_turns_back():
    """He came past the robot to a wall, and rests there: he may come again, as far as he may go on where there is none."""
    for walls, turns_back in (([Box(1.6, -3, 1.7, 3)], True), ([], False)):
        shield = shield_of()
        for k, x in enumerate([*np.arange(0.7, 1.3, 0.7 * PERIOD_S), *np.full(6, 1.3)]):
            him = coming(x, 0.7 if x < 1.3 else 0.0)
            belief = belief_of([Disc(x, 0.0, 0.25), *walls], size_m=4.0)
            belief = replace(belief, tracks=(him,), stamp_ns=round(k * PERIOD_S * 1e9))
            result = shield.filter(command_of(BodyTwist()), belief, reachable_from(BodyTwist(), DIFFERENTIAL, PERIOD_S))
        assert result.diagnostics.asked_feasible != turns_back


@pytest.mark.parametrize(("came_m", "rested_s"), [(0.1, 0.3), (0.6, 1.3)], ids=["a post", "he stays"])
def test_who_did_not_come_or_has_stood_for_long_stays(came_m, rested_s):
    assert after_he_came(shield_of(patience_s=1.0), came_m, rested_s).diagnostics.asked_feasible


def test_what_a_new_track_is_first_taken_for_is_not_how_he_came():
    """His first velocity is a guess: he seems to rush at the robot, but comes past it, and goes on past it."""
    shield = shield_of()
    for k, y in enumerate(np.arange(-1.2, 0.0, 0.5 * PERIOD_S)):
        seen = replace(coming(1.2, 0.0), position_in_odom=(1.2, y), velocity_in_odom=(-0.8, 0.1) if k < 3 else (0.0, 0.5))
        belief = replace(belief_of([], size_m=4.0), tracks=(seen,), stamp_ns=round(k * PERIOD_S * 1e9))
        result = shield.filter(command_of(BodyTwist()), belief, reachable_from(BodyTwist(), DIFFERENTIAL, PERIOD_S))
    assert result.diagnostics.asked_feasible


def test_a_shield_that_takes_over_knows_how_he_came():
    first, second = shield_of(), shield_of()
    after_he_came(first, came_m=0.6, rested_s=0.3)
    second.restore(first.snapshot())
    again = [after_he_came(shield, came_m=0.0, rested_s=PERIOD_S) for shield in (first, second)]
    assert not again[0].diagnostics.asked_feasible
    assert again[0].command == again[1].command
    assert first.snapshot() == second.snapshot()
