"""How fast somebody closes in: each look counts along each direction for as much as it says there, and no more."""

from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.geometry import SE2
from estimators.belief import FREE, UNKNOWN
from planners.clearance_manifold.boundary_kernels import SHARE, nearest_closing
from planners.clearance_manifold.closing import ClosingMemory
from planners.clearance_manifold.prediction import ArrivalField
from planners.clearance_manifold.settings import PredictionSettings
from planners.clearance_manifold.sight_kernels import in_sight, sight_of
from tests.planners.boundaries import found
from tests.planners.synthetic import Box, Disc, belief_of

FIELD = belief_of([]).clearance
AGE_S = np.zeros(FIELD.known.shape, np.float32)
SETTINGS = PredictionSettings(fov_deg=87.0, range_m=2.8)


def told_of(memory, seen, elapsed_s=0.05):
    """Return who closes in, shape (5,), after one more look."""
    return memory.update(seen[None], FIELD, AGE_S, elapsed_s)[0]


def after(memory, ticks=20):
    """Let somebody come along x with 0.8 m/s for so many looks, to x = 1."""
    for tick in range(ticks):
        told = told_of(memory, found(1.0 + 0.04 * (ticks - 1 - tick), 0.0, -0.8, 0.0))
    return told


@pytest.mark.parametrize("speed", [0.6, 1.2])
def test_the_end_of_a_wall_stops_closing_in_and_a_walker_does_not(speed):
    """Both are first seen with the same rate; the wall's fades as it is smoothed, and its middle stays."""
    rng = np.random.default_rng(3)
    field = belief_of([]).clearance
    age = np.zeros(field.known.shape, np.float32)
    wall, walker = ClosingMemory(1.0), ClosingMemory(1.0)
    for tick in range(12):
        noise = rng.normal(0.0, 0.04, 2)
        ends = found(2.0 + noise[0], 1.4 + noise[1], 0.0, -speed * np.exp(-0.05 * tick / 0.56))
        comes = found(2.0 + noise[0], 1.4 - 0.05 * speed * tick + noise[1], 0.0, -1.5 * speed)  # a rate too high
        still, moves = (memory.update(seen[None], field, age, 0.05)[0] for memory, seen in ((wall, ends), (walker, comes)))
    assert np.hypot(*still[2:4]) < 0.45 * speed * np.exp(-0.05 * 11 / 0.56)
    assert moves[3] == pytest.approx(-speed, rel=0.35)


def test_beside_a_front_rates_say_nothing_of_what_leads_along_it():
    """All slopes lead along x, as beside a wall: the velocity along y is the least that fits, and that is not seen."""
    memory = ClosingMemory(1.0)
    before = after(memory)
    for tick in range(1, 8):
        told = told_of(memory, found(1.0 - 0.04 * tick, 0.0, -0.8, 3.0, slopes=(1.0, 0.0, 0.0)))
    assert told[2:4] == pytest.approx(before[2:4], abs=0.05)


def test_a_middle_that_moves_because_more_of_him_is_seen_is_no_velocity():
    """At the edge of view no cell gives a rate, and the middle comes 0.3 m to the side within 0.3 s."""
    memory = ClosingMemory(1.0)
    after(memory)
    for tick in range(1, 7):
        told = told_of(memory, found(1.0 - 0.04 * tick, 0.05 * tick, 0.0, 0.0, slopes=(0.0, 0.0, 0.0), share=0.0))
    assert told[2:4] == pytest.approx([-0.8, 0.0], abs=0.1)


def test_one_look_that_is_far_off_does_not_turn_him():
    memory = ClosingMemory(1.0)
    after(memory)
    told = told_of(memory, found(0.96, 0.4, -0.8, 2.0))
    assert told[2:4] == pytest.approx([-0.8, 0.0], abs=0.35)


def test_who_has_no_rate_yet_does_not_close_in():
    memory = ClosingMemory(1.0)
    for tick in range(6):
        told = told_of(memory, found(1.0 - 0.04 * tick, 0.0, 0.0, 0.0, slopes=(0.0, 0.0, 0.0), share=0.0))
        assert not told.any()
        assert memory.begins[0]
    assert told_of(memory, found(0.76, 0.0, -0.8, 0.0))[2] == pytest.approx(-0.6, abs=0.2)  # and then at once


@pytest.mark.parametrize("fov_deg", [87.0, 120.0, 260.0])
def test_in_sight_is_what_is_farther_from_all_edges_of_the_view_than_its_clearance(fov_deg):
    pose, half = SE2(0.3, -0.2, 0.7), np.radians(0.5 * fov_deg)
    sight, rng = sight_of(pose, 2.0 * half, 0.3, 2.5), np.random.default_rng(1)
    angles = np.linspace(half, 2.0 * np.pi - half, 2000)
    out = np.concatenate([r * np.stack((np.cos(angles), np.sin(angles)), axis=1) for r in np.linspace(0.0, 6.0, 121)])
    for _ in range(200):
        point, around_m = rng.uniform(-3.0, 3.0, 2), rng.uniform(0.05, 0.8)
        away = np.hypot(*point)
        edge_m = np.hypot(*(out - point).T).min()
        if min(abs(edge_m - around_m), abs(away - around_m - 0.3), abs(away + around_m - 2.5)) < 0.04:
            continue
        expected = edge_m > around_m and away - around_m > 0.3 and away + around_m < 2.5
        assert in_sight(*pose.apply(point), around_m, sight) == expected


def test_who_was_not_there_a_window_ago_has_no_velocity():
    """The field fell by 1.5 m in 0.2 s where he appeared: that is no speed of his."""
    now, then = (belief_of([Disc(1.5, y, 0.25)]).clearance for y in (0.2, 1.9))
    recent = (now.clearance_m - then.clearance_m) / np.float32(0.2)
    lattice, sight = now.lattice, sight_of(SE2(), np.pi, 0.0, 9.0)
    corner = np.array([lattice.x_m, lattice.y_m])
    one = nearest_closing(now.clearance_m, recent, recent, 0.2, corner, lattice.cell_m, np.stack((sight, sight)), 0.25, 1)[0]
    assert np.hypot(*one[2:4]) < 1.0
    assert one[SHARE] < 0.1


def seen_with_noise(walker, wall, pose, rng, t):
    """Return the belief at a time: cells out of view are unknown, and the clearance has the noise of its cells."""
    belief = belief_of([walker.at(t), wall], pose)
    field, at = belief.clearance, belief.clearance.lattice
    rows, columns = np.divmod(np.arange(field.known.size), at.columns)
    x, y = at.centres(rows, columns).T
    bearing = np.abs(np.arctan2(y - pose.y, x - pose.x) - pose.yaw)
    known = ((bearing < np.radians(43.5)) & (np.hypot(x - pose.x, y - pose.y) < 2.8)).reshape(field.known.shape)
    clearance = np.maximum(field.clearance_m + rng.uniform(-0.025, 0.025, known.shape), 0.0).astype(np.float32)
    clearance[field.clearance_m <= 0.0] = 0.0
    rate = np.where(known, field.rate_m_s, np.float32(0.0))
    label = np.where(known, FREE, UNKNOWN).astype(np.uint8)
    field = replace(field, clearance_m=clearance, rate_m_s=rate, known=known)
    return replace(belief, clearance=field, grid=replace(belief.grid, label=label), stamp_ns=round(1e9 * t))


@pytest.mark.parametrize("period_s", [0.05, 0.2])
@pytest.mark.parametrize("turning_rad_s", [0.0, 0.5])
def test_the_velocity_of_who_comes_along_a_wall_is_his(period_s, turning_rad_s):
    """0.3 m from the wall at 0.7 m/s, with the noise of cells, seen by a robot that turns or not: within 0.2 m/s after 0.6 s."""
    field, rng = ArrivalField(SETTINGS, 0.12), np.random.default_rng(5)
    walker, wall = Disc(2.6, 0.1, 0.25, -0.7, 0.0), Box(-4.0, 0.65, 6.0, 0.9)
    for tick in range(round(1.8 / period_s)):
        t = tick * period_s
        told = field.update(seen_with_noise(walker, wall, SE2(0.0, 0.0, turning_rad_s * (t - 0.9)), rng, t)).closing
        if t >= 0.6:
            near = told[np.argmin(np.hypot(told[:, 0] - walker.at(t).x, told[:, 1] - 0.1) + 9.0 * (told[:, 4] == 0.0))]
            assert near[2:4] == pytest.approx([-0.7, 0.0], abs=0.2)
            assert near[:2] == pytest.approx([walker.at(t).x, 0.1], abs=0.15)
