"""The clearance field against brute force, and a rate that is obstacle motion and nothing else."""

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from drivers.interface.seeds import stream
from estimators.belief import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from estimators.clearance import ClearanceEstimator, ClearanceSettings, distance_to
from estimators.memory.rolling import lattice_around

CELL_M = 0.05
FRAME_NS = 66_000_000
FRAME_S = FRAME_NS * 1e-9


def grid_of(label, x=0.0, y=0.0):
    return OccupancyGrid(lattice_around(x, y, CELL_M, *label.shape), np.asarray(label, dtype=np.uint8))


def empty(rows=60, columns=80):
    return np.full((rows, columns), FREE, dtype=np.uint8)


def estimator(**settings):
    return ClearanceEstimator(ClearanceSettings(**settings))


@pytest.mark.parametrize(("rows", "columns", "share"), [(120, 120, 0.02), (40, 70, 0.2), (33, 20, 0.003)])
def test_distances_equal_brute_force(rows, columns, share):
    occupied = stream(rows, "occupied").random((rows, columns)) < share
    cells = np.argwhere(np.ones_like(occupied))
    nearest, _ = cKDTree(np.argwhere(occupied)).query(cells)
    np.testing.assert_allclose(distance_to(occupied, CELL_M).ravel(), nearest * CELL_M, rtol=2e-7)


def test_distances_are_the_same_bits_wherever_the_array_lies():
    occupied = stream(1, "occupied").random((120, 120)) < 0.003
    answers = set()
    for offset in range(64):
        memory = np.zeros(occupied.size + 64, dtype=np.bool_)
        moved = memory[offset : offset + occupied.size].reshape(occupied.shape)
        moved[:] = occupied
        answers.add(distance_to(moved, CELL_M).tobytes())
    assert len(answers) == 1


def test_without_obstacles_the_clearance_is_capped():
    field = estimator().update(grid_of(empty()), 0)
    assert (field.clearance_m == np.float32(80 * CELL_M)).all()


def test_known_and_overlap():
    label = empty()
    label[:, :10] = UNKNOWN
    clearance = estimator()
    first = clearance.update(grid_of(label), 0)
    assert not first.overlap.any()
    assert (first.known == (label != UNKNOWN)).all()
    moved = empty()
    moved[:5] = UNKNOWN
    second = clearance.update(grid_of(moved), FRAME_NS)
    assert (second.overlap == (second.known & first.known)).all()


def test_an_approaching_wall_has_its_negative_speed_as_rate():
    clearance = estimator(rate_smoothing=1.0)
    for step in range(3):
        label = empty()
        label[:, 70 - step] = OCCUPIED
        field = clearance.update(grid_of(label), step * FRAME_NS)
    ahead = field.rate_m_s[:, 10:60]
    np.testing.assert_allclose(ahead, -CELL_M / FRAME_S, rtol=0.03)
    receding = clearance.update(grid_of(np.roll(label, 1, axis=1)), 3 * FRAME_NS)
    np.testing.assert_allclose(receding.rate_m_s[:, 10:60], CELL_M / FRAME_S, rtol=0.03)


def test_past_a_static_scene_the_rate_is_zero():
    world = np.where(stream(5, "world").random((200, 200)) < 0.02, OCCUPIED, FREE).astype(np.uint8)
    clearance = estimator()
    for step in range(8):  # two cells a frame: what enters the window is new, what leaves it is gone
        label = world[20 + step : 80 + step, 2 * step : 2 * step + 80]
        field = clearance.update(grid_of(label, x=2 * step * CELL_M, y=step * CELL_M), step * FRAME_NS)
        inner = np.zeros_like(field.overlap)
        inner[:-1, :-2] = step > 0
        assert (field.overlap == inner).all()
        assert not field.rate_m_s.any()


def test_a_wall_that_comes_into_view_is_not_an_approach():
    clearance = estimator()
    label = empty()
    label[:, 40:] = UNKNOWN
    clearance.update(grid_of(label), 0)
    label[:, 40:45], label[:, 45] = FREE, OCCUPIED
    field = clearance.update(grid_of(label), FRAME_NS)
    assert field.clearance_m[30, 39] == pytest.approx(6 * CELL_M)
    assert not field.rate_m_s.any()


def test_a_rate_that_is_not_asked_for_is_zero_and_clearances_are_the_same():
    with_rate, without = estimator(rate_smoothing=1.0), estimator(rate=False)
    for step, column in enumerate((60, 58)):
        label = empty()
        label[:, column] = OCCUPIED
        moved, still = (one.update(grid_of(label), step * FRAME_NS) for one in (with_rate, without))
    assert moved.rate_m_s.any()
    assert not still.rate_m_s.any()
    assert not still.overlap.any()
    np.testing.assert_array_equal(still.clearance_m, moved.clearance_m)


def test_the_smoothing_is_the_papers_at_any_frame_rate():
    """After a step of the rate, the smoothed one has covered 1 - 0.7^(t / 0.2 s) of it."""
    for frame_ns in (40_000_000, 100_000_000, 200_000_000):
        clearance = estimator(rate_smoothing=0.3)
        for step in range(1, 400_000_000 // frame_ns + 2):
            label = empty()
            label[:, 75 - step] = OCCUPIED
            field = clearance.update(grid_of(label), step * frame_ns)
        full = -CELL_M / (frame_ns * 1e-9)
        assert field.rate_m_s[30, 20] / full == pytest.approx(1.0 - 0.7**2, rel=0.03)


def test_cells_beyond_the_overlap_have_no_rate():
    clearance = estimator()
    for step in range(2):
        label = empty()
        label[:, 70 - step] = OCCUPIED
        label[:20] = UNKNOWN
        field = clearance.update(grid_of(label), step * FRAME_NS)
    assert not field.rate_m_s[:20].any()
    assert field.rate_m_s[20:, 30].all()


def test_the_same_frame_again_keeps_its_rate():
    clearance = estimator()
    for step in range(2):
        label = empty()
        label[:, 70 - step] = OCCUPIED
        field = clearance.update(grid_of(label), step * FRAME_NS)
    again = clearance.update(grid_of(label[:, 3:-3], x=0.0), FRAME_NS)
    np.testing.assert_array_equal(again.rate_m_s, field.rate_m_s[:, 3:-3])


def test_restored_it_goes_on_identically_and_shares_nothing():
    random = stream(9, "labels")
    labels = [random.choice([FREE, OCCUPIED, UNKNOWN], (60, 80), p=[0.7, 0.05, 0.25]) for _ in range(4)]
    first, second = estimator(), estimator()
    assert second.snapshot() == first.snapshot()
    second.restore(first.snapshot())
    fields = [first.update(grid_of(label), step * FRAME_NS) for step, label in enumerate(labels[:3])]
    second.restore(first.snapshot())
    one, other = first.update(grid_of(labels[3]), 3 * FRAME_NS), second.update(grid_of(labels[3]), 3 * FRAME_NS)
    for name in ("clearance_m", "rate_m_s", "known", "overlap"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert not getattr(one, name).flags.writeable
        assert not any(np.shares_memory(getattr(one, name), getattr(field, name)) for field in fields)
    assert math.isfinite(float(np.abs(one.rate_m_s).max()))
