"""The look-out: when who is not seen can be in the way, which openings there are, and who is let by at a blind corner."""

import math

import numpy as np
import pytest

from planners.clearance_manifold.lookout import Lookout
from planners.clearance_manifold.lookout_kernels import Seen, Unseen, arrival, arrivals, openings
from planners.clearance_manifold.planner import ClearanceManifold
from planners.clearance_manifold.settings import ClearanceManifoldSettings, LookoutSettings
from planners.planner import PlannerSetup
from tests.planners.blind_corner import PERIOD_S, RADIUS_M, Corner, meet
from tests.planners.synthetic import OMNI, Box, belief_of

CELL_M = 0.05
WALKER = Unseen(speed_m_s=0.8, apart_m=0.25, width_m=0.4, side_m=2.4)


def strip(known_m, age_s, wall_m=None):
    """Return ground that is known up to a distance along y from (0, 0), seen so long ago (a function of the distance)."""
    rows, columns = 80, 9
    y = (np.arange(rows) + 0.5) * CELL_M
    known = np.repeat((y < known_m)[:, None], columns, axis=1)
    age = np.repeat(np.array([age_s(v) for v in y], np.float32)[:, None], columns, axis=1)
    clearance = np.full((rows, columns), 5.0, np.float32)
    if wall_m is not None:
        clearance[:] = np.abs(np.maximum(wall_m - y, 0.0))[:, None]
    return Seen(known, clearance, age, -0.2, 0.0, CELL_M)


@pytest.mark.parametrize("depth_m", [0.6, 1.2, 2.0])
def test_what_is_in_view_now_is_safe_for_as_long_as_the_way_from_its_edge_takes(depth_m):
    when, whence = arrival(strip(depth_m, lambda y: 0.0), 0.0, 0.0, 0.0, 1.0, WALKER)
    assert when == pytest.approx((depth_m - WALKER.apart_m) / WALKER.speed_m_s, abs=0.07)
    assert whence == pytest.approx(depth_m, abs=0.06)


def test_what_was_in_view_lets_him_come_nearer_with_its_age():
    """Seen 1 s ago up to 2 m: he may have come 0.8 m nearer since; in what is in view now he is not."""
    aged, _ = arrival(strip(2.0, lambda y: 1.0), 0.0, 0.0, 0.0, 1.0, WALKER)
    assert aged == pytest.approx((2.0 - WALKER.apart_m) / WALKER.speed_m_s - 1.0, abs=0.07)
    near, _ = arrival(strip(2.0, lambda y: 0.0 if y < 1.0 else 30.0), 0.0, 0.0, 0.0, 1.0, WALKER)
    assert near == pytest.approx((1.0 - WALKER.apart_m) / WALKER.speed_m_s, abs=0.07)


def test_nobody_comes_through_a_wall_and_from_the_unknown_anybody_at_once():
    assert arrival(strip(2.0, lambda y: 9.0, wall_m=1.0), 0.0, 0.0, 0.0, 1.0, WALKER)[0] == math.inf
    assert arrival(strip(0.1, lambda y: 0.0), 0.0, 0.0, 0.0, 1.0, WALKER)[0] == -math.inf


def seen_of(belief, up_to_y_m):
    at, field = belief.clearance.lattice, belief.clearance
    known = np.repeat(((at.y_m + (np.arange(at.rows) + 0.5) * at.cell_m) < up_to_y_m)[:, None], at.columns, axis=1)
    return Seen(known, field.clearance_m, np.where(known, 0.0, 1e6).astype(np.float32), at.x_m, at.y_m, at.cell_m)


@pytest.mark.parametrize(("width_m", "open_"), [(0.3, False), (0.9, True)])
def test_an_opening_is_as_long_as_the_gap_in_the_wall_and_what_the_robot_must_keep(width_m, open_):
    begin = 0.8
    walls = [Box(-3, 0.6, begin, 3), Box(begin + width_m, 0.6, 3, 3), Box(-3, -3, 3, -0.6)]
    arcs = np.arange(-0.27, 2.4, 0.1)
    at, normal = np.stack((arcs, np.zeros_like(arcs)), axis=1), np.tile([0.0, 1.0], (len(arcs), 1))
    unseen = Unseen(0.8, 0.27, 0.4, 2.4)
    when, _ = arrivals(seen_of(belief_of(walls), 1.2), at, normal, 0.1, unseen)
    found = openings(when, arcs, unseen)
    assert len(found) == int(open_)
    if open_:
        assert found[0, :2] == pytest.approx([begin - 0.27, begin + width_m + 0.27], abs=0.16)


def test_open_ground_is_no_opening():
    arcs = np.arange(-0.27, 2.4, 0.1)
    at, normal = np.stack((arcs, np.zeros_like(arcs)), axis=1), np.tile([0.0, 1.0], (len(arcs), 1))
    unseen = Unseen(0.8, 0.27, 0.4, 2.4)
    assert not len(openings(arrivals(seen_of(belief_of([]), 1.2), at, normal, 0.1, unseen)[0], arcs, unseen))


def test_patience_lowers_who_is_reckoned_with_and_ends():
    watch = Lookout(LookoutSettings(), OMNI, RADIUS_M, 0.5)
    arcs = watch.arcs_m
    at, normal = np.stack((arcs, np.zeros_like(arcs)), axis=1), np.tile([0.0, 1.0], (len(arcs), 1))
    seen = seen_of(belief_of([Box(-3, 0.6, 0.6, 3), Box(1.4, 0.6, 3, 3), Box(-3, -3, 3, -0.6)]), 0.9)
    told = [watch.watch(seen, at, normal, 0.0, 0.1) for _ in range(90)]
    assert told[0].waits
    assert told[0].free_m == pytest.approx(0.6 - 0.27, abs=0.1)
    assert told[0].look_at[1] > 0.5
    assert told[30].demand_m_s == 1.25 > told[60].demand_m_s > 0.0
    assert not told[-1].waits


def driver(walker_speed_m_s):
    settings = ClearanceManifoldSettings(prediction={"fov_deg": 87.0}, lookout={"walker_speed_m_s": walker_speed_m_s})
    return ClearanceManifold(settings, PlannerSetup(PERIOD_S, RADIUS_M, OMNI, 0))


@pytest.mark.parametrize(
    ("corner", "speed_m_s", "meet_s"),
    [(Corner(), 0.65, 9.5), (Corner(both=True), 0.4, 9.0)],
)
def test_at_the_edge_of_its_range_every_walker_is_let_by(corner, speed_m_s, meet_s):
    """README: up to 0.65 m/s from one side and 0.4 m/s from either, whenever he comes; these times are the worst."""
    least, reached_s = meet(driver(speed_m_s), corner, speed_m_s, meet_s)
    assert least > 0.02
    assert reached_s < 25.0


def test_without_the_look_out_the_same_walker_is_met():
    settings = ClearanceManifoldSettings(prediction={"fov_deg": 87.0}, lookout={"enabled": False})
    planner = ClearanceManifold(settings, PlannerSetup(PERIOD_S, RADIUS_M, OMNI, 0))
    assert min(meet(planner, Corner(), 1.25, meet_s, duration_s=8.0)[0] for meet_s in (5.0, 5.5)) < 0.02
