"""Who closes in: how fast he was of late, where he will still come, and where the robot may give way to."""

import numpy as np
import pytest

from drivers.interface.geometry import SE2
from estimators.belief import ClearanceField, Lattice
from planners.clearance_manifold.branch_kernels import BODY_M, encounters
from planners.clearance_manifold.control_kernels import known_way
from planners.clearance_manifold.prediction_kernels import THICK_M, nearest_closing
from planners.clearance_manifold.recent_rate import WINDOW_S, RecentRate
from planners.clearance_manifold.ridge_kernels import Sections

OFFSETS = np.linspace(-1.0, 1.0, 5)
CELL_M = 0.05


def field_of(clearance_m, known=None, corner=(0.0, 0.0)):
    clearance = np.full((6, 8), clearance_m, np.float32)
    seen = np.ones(clearance.shape, np.bool_) if known is None else known
    return ClearanceField(Lattice(*corner, CELL_M, *clearance.shape), clearance, np.zeros_like(clearance), seen, seen)


@pytest.mark.parametrize("period_s", [0.05, 0.2])
def test_the_recent_rate_has_caught_up_a_window_after_somebody_sets_off(period_s):
    rate, still_s = RecentRate(), 1.0
    for tick in range(round(2.0 / period_s)):
        now_s = tick * period_s
        recent = rate.update(field_of(2.0 - max(0.0, now_s - still_s)), round(now_s * 1e9))
        if now_s >= still_s + 2.0 * WINDOW_S:
            assert recent == pytest.approx(np.full((6, 8), -1.0), abs=1e-4)
        elif now_s <= still_s and tick:
            assert recent == pytest.approx(np.zeros((6, 8)), abs=1e-6)


def test_the_recent_rate_knows_nothing_of_cells_that_were_not_seen_then_and_moves_with_the_window():
    rate, known = RecentRate(), np.ones((6, 8), np.bool_)
    known[:, 3] = False
    rate.update(field_of(1.0, known), 0)
    recent = rate.update(field_of(0.9, corner=(2 * CELL_M, 0.0)), round(WINDOW_S * 1e9))
    assert np.isnan(recent[:, [1, 6, 7]]).all()  # not seen then, and off the window then
    assert recent[:, [0, 2, 3, 4, 5]] == pytest.approx(np.full((6, 5), -0.5), abs=1e-4)


def test_what_was_taken_in_goes_on_from_a_snapshot():
    rate, other = RecentRate(), RecentRate()
    for k in range(7):
        rate.update(field_of(1.0 - 0.03 * k), k * 50_000_000)
    other.take(rate.state())
    later = (field_of(0.7), 350_000_000)
    assert (rate.update(*later) == other.update(*later)).all()


def clearance_beside_a_wall(x_m, y_m):
    """Return the distance to what is seen of a disc there, its near half, and to a wall 0.3 m left of y = 0."""
    y, x = (np.mgrid[0:60, 0:80] + 0.5) * CELL_M + np.array([-1.5, 0.0])[:, None, None]
    turned = np.linspace(0.5 * np.pi, 1.5 * np.pi, 40)
    disc = np.stack((x_m + THICK_M * np.cos(turned), y_m + THICK_M * np.sin(turned)), axis=1)
    wall = np.stack((np.linspace(1.7, 2.3, 25), np.full(25, 0.3)), axis=1)
    at = np.concatenate((disc, wall))
    return np.hypot(x[..., None] - at[:, 0], y[..., None] - at[:, 1]).min(axis=2).astype(np.float32)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_who_comes_along_beside_something_is_where_he_is_and_not_where_he_is_seen(side):
    """Between him and the wall the clearance is the wall's, so what is seen of him is the other half of his near side."""
    before, now = (clearance_beside_a_wall(x_m, 0.0)[:: int(side)] for x_m in (2.2, 2.0))
    rate = (now - before) / np.float32(0.25)
    rate[:, round(2.0 / CELL_M) :] = 0.0  # nothing is seen through him
    found = nearest_closing(now, rate, rate, 0.25, np.array([0.0, -1.5]), CELL_M, np.array([0.5, 0.0]), 0.25, 1)[0]
    assert found[0] == pytest.approx(2.0, abs=0.1)
    assert found[1] == pytest.approx(0.0, abs=0.03)


@pytest.mark.parametrize("step_m", [0.10, 0.15, 0.20])
def test_the_rate_over_a_window_goes_with_the_slopes_in_the_middle_of_it(step_m):
    """A post comes along x at 0.8 m/s, and closes in on one side only: with the last slopes it seems to come to that side."""
    y, x = (np.mgrid[0:60, 0:80] + 0.5) * CELL_M + np.array([-1.5, 0.0])[:, None, None]
    before, now = (np.hypot(x - x_m, y).astype(np.float32) for x_m in (2.0 + step_m, 2.0))
    recent = (now - before) / np.float32(step_m / 0.8)
    rate = np.where((x < 2.0) & (y < 0.0), recent, np.float32(0.0))
    middle, last = (
        nearest_closing(now, rate, recent, window_s, np.array([0.0, -1.5]), CELL_M, np.array([0.5, 0.0]), 0.25, 1)[0]
        for window_s in (step_m / 0.8, 0.0)
    )
    assert middle[2:4] == pytest.approx([-0.8, 0.0], abs=0.18)
    assert abs(middle[3]) < 0.5 * abs(last[3])


def sections_at(xs):
    return Sections(
        np.stack((np.array(xs), np.zeros(len(xs))), axis=1), np.tile([0.0, 1.0], (len(xs), 1)), np.zeros((len(xs), 2))
    )


def apart_at(xs, closing):
    return encounters(sections_at(xs), OFFSETS, np.zeros(2), 0.5, 3.0, np.array([[*closing, 20.0]]))


def test_a_place_that_somebody_still_comes_to_is_taken_however_late_the_robot_is():
    """He crosses from the right to the left, 1 m ahead, and is there after 1 s; the robot not before 0.7 * 2 s."""
    apart = apart_at([1.0], (1.0, -0.5, 0.0, 0.5))[0]
    late = 0.7 * np.hypot(1.0, OFFSETS) / 0.5
    assert apart == pytest.approx(np.where(-0.5 + 0.5 * late < OFFSETS, 0.0, -0.5 + 0.5 * late - OFFSETS) - BODY_M, abs=1e-9)
    assert apart[0] > 0.9  # behind him
    assert apart[-1] == pytest.approx(-BODY_M)  # where he goes


def test_beyond_the_horizon_he_counts_where_he_is_by_then():
    apart = apart_at([1.0], (1.0, -3.0, 0.0, 0.5))[0]
    assert apart == pytest.approx(OFFSETS + 1.5 - BODY_M)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_the_known_way_ends_before_the_body_meets_what_was_never_seen(yaw):
    known = np.ones((80, 80), np.bool_)
    corner, robot = np.array([-2.0, -2.0]), np.zeros(2)
    along = SE2(0.0, 0.0, yaw).apply(np.array([1.0, 0.0]))
    y, x = np.mgrid[0:80, 0:80] * CELL_M - 2.0 + 0.5 * CELL_M
    known[(x * along[0] + y * along[1]) > 0.55] = False  # from here on, in that direction
    free_m = known_way(known, corner, CELL_M, robot, along, 0.12, 0.25, 0.15, 0.6)
    assert free_m == pytest.approx(0.3, abs=0.05)
    assert known_way(known, corner, CELL_M, robot, -along, 0.12, 0.25, 0.15, 0.6) == pytest.approx(0.6, abs=0.01)
