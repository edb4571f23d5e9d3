"""The filtered branch: what it smooths far away, and that it changes nothing near the sensor."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from drivers.interface.geometry import SE2
from drivers.interface.seeds import stream
from estimators.belief import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from estimators.grid.depth_grid import DepthGrid, DepthGridSettings
from estimators.grid.grid_filter import GridFilter, GridFilterSettings
from estimators.grid.labelling import FrameLabels, lattice_in_reach
from tests.estimators.scenes import MS, Floor, Pillar, Wall, frame

CELL_M = 0.05
FRAME_NS = 33_333_333
FAR = (2.22, 0.02)


def filter_of(**how):
    return GridFilter(GridFilterSettings(**{"median_radius_m": 0.0, "closing_radius_m": 0.0, **how}), CELL_M)


def frame_of(cells=(), x=0.0, y=0.0, label=None):
    """A frame whose sensor stands at (x, y), with the cells given as {(x, y): label}."""
    lattice = lattice_in_reach(x, y, 3.0, CELL_M)
    shape = (lattice.rows, lattice.columns)
    labels = np.full(shape, FREE, dtype=np.uint8) if label is None else label
    for (cx, cy), value in dict(cells).items():
        labels[lattice.cell_of(np.array([[cx, cy]]))] = value
    return FrameLabels(OccupancyGrid(lattice, labels), np.zeros(shape, dtype=np.bool_))


def at(labels, x, y):
    return labels.grid.label[labels.grid.lattice.cell_of(np.array([[x, y]]))][0]


@pytest.mark.parametrize(("period_ns", "frames"), [(FRAME_NS, 2), (FRAME_NS // 2, 4), (2 * FRAME_NS, 1)])
def test_far_away_belief_takes_the_same_time_at_every_frame_rate(period_ns, frames):
    """1 - 0.65^n exceeds a half at n = 2 frames of 1/30 s; one frame of 1/15 s is as good as two."""
    smooth = filter_of()
    smooth.apply(frame_of(), 0)
    seen = [at(smooth.apply(frame_of({FAR: OCCUPIED}), (n + 1) * period_ns), *FAR) for n in range(frames)]
    assert seen == [UNKNOWN] * (frames - 1) + [OCCUPIED]


def test_what_is_no_longer_seen_far_away_lingers_a_little():
    smooth = filter_of()
    for n in range(10):
        smooth.apply(frame_of({FAR: OCCUPIED}), n * FRAME_NS)
    assert [at(smooth.apply(frame_of(), (10 + n) * FRAME_NS), *FAR) for n in range(3)] == [OCCUPIED, FREE, FREE]


def test_smoothing_is_of_the_world_and_not_of_the_picture():
    smooth = filter_of()
    for n in range(6):
        seen = smooth.apply(frame_of({(3.02, 0.02): OCCUPIED}, x=0.1 * n), n * FRAME_NS)
    assert at(seen, 3.02, 0.02) == OCCUPIED


def test_median_and_opening_remove_specks_and_closing_fills_gaps():
    wall = {(x, y): OCCUPIED for y in np.arange(-0.475, 0.5, CELL_M) for x in (2.17, 2.22, 2.27)}
    speck, gap = {(2.22, 1.02): OCCUPIED}, (2.22, 0.02)
    assert at(filter_of(median_radius_m=0.05).apply(frame_of(wall | speck), 0), 2.22, 1.02) == UNKNOWN
    assert at(filter_of(opening_radius_m=0.05).apply(frame_of(wall | speck), 0), 2.22, 1.02) == UNKNOWN
    holed = wall | {gap: FREE}
    assert at(filter_of().apply(frame_of(holed), 0), *gap) == FREE
    assert at(filter_of(closing_radius_m=0.05).apply(frame_of(holed), 0), *gap) == OCCUPIED


def test_the_median_keeps_a_wall_of_one_cell_with_nothing_known_behind():
    wall = {(2.22, y): OCCUPIED for y in np.arange(-0.475, 0.5, CELL_M)}
    behind = {(x, y): UNKNOWN for y in np.arange(-0.475, 0.5, CELL_M) for x in (2.27, 2.32, 2.37)}
    seen = filter_of(median_radius_m=0.05).apply(frame_of(wall | behind), 0)
    assert [at(seen, 2.22, y) for y in np.arange(-0.4, 0.45, CELL_M)] == [OCCUPIED] * 17


FILTERS = st.builds(
    GridFilterSettings,
    temporal_retention=st.floats(0.0, 0.99),
    median_radius_m=st.floats(0.0, 0.2),
    opening_radius_m=st.floats(0.0, 0.5),
    closing_radius_m=st.floats(0.0, 0.5),
    near_m=st.floats(1.5, 3.0),
)


@settings(max_examples=40, deadline=None)
@given(how=FILTERS, seed=st.integers(0, 10_000), occupied=st.floats(0.01, 0.5))
def test_near_the_sensor_nothing_is_hidden_and_nothing_added(how, seed, occupied):
    random, smooth = stream(seed, "labels"), GridFilter(how, CELL_M)
    for n in range(4):
        x, y = random.uniform(-0.3, 0.3, 2)
        side = lattice_in_reach(x, y, 3.0, CELL_M).rows
        chance = [occupied, (1 - occupied) / 2, (1 - occupied) / 2]
        label = random.choice(np.array([OCCUPIED, FREE, UNKNOWN], dtype=np.uint8), (side, side), p=chance)
        raw = frame_of(x=x, y=y, label=label)
        seen = smooth.apply(raw, n * FRAME_NS)
        lattice = raw.grid.lattice
        rows, columns = np.indices(label.shape).reshape(2, -1)
        near = (np.hypot(*(lattice.centres(rows, columns) - [x, y]).T) <= how.near_m).reshape(label.shape)
        assert seen.grid.lattice == lattice
        assert np.array_equal(seen.grid.label[near], label[near])
        assert seen.blind is raw.blind


@settings(max_examples=25, deadline=None)
@given(bearing=st.floats(-0.6, 0.6), range_m=st.floats(0.5, 1.45), radius_m=st.floats(0.04, 0.3), seed=st.integers(0, 1000))
def test_a_pillar_nearer_than_a_metre_and_a_half_that_raw_depth_shows_is_shown_at_once(bearing, range_m, radius_m, seed):
    how = DepthGridSettings(filtered=True)
    front_end, smooth, random = DepthGrid(how, CELL_M), GridFilter(how.filter, CELL_M), stream(seed, "depth")
    pillar = Pillar((range_m + radius_m) * np.cos(bearing), (range_m + radius_m) * np.sin(bearing), radius_m)

    def noisy(depth):
        return depth * (1.0 + 0.004 * random.normal(size=depth.shape))

    smooth.apply(front_end.label(frame([Floor(), Wall(0.0, 2.4)], spoil=noisy), SE2()), 0)
    raw = front_end.label(frame([Floor(), Wall(0.0, 2.4), pillar], spoil=noisy), SE2())
    seen = smooth.apply(raw, 66 * MS)
    rows, columns = np.nonzero(raw.grid.label == OCCUPIED)
    centres = raw.grid.lattice.centres(rows, columns)
    shown = np.hypot(*centres.T) < 1.5
    assert (seen.grid.label[rows[shown], columns[shown]] == OCCUPIED).all()


def test_settings_that_would_hide_near_obstacles_are_refused():
    with pytest.raises(ValidationError):
        GridFilterSettings(near_m=1.0)
    with pytest.raises(ValidationError):
        GridFilterSettings(median_radius_m=-0.1)


def test_restored_it_goes_on_identically():
    first, second = GridFilter(GridFilterSettings(), CELL_M), GridFilter(GridFilterSettings(), CELL_M)
    first.apply(frame_of({FAR: OCCUPIED}), 0)
    second.restore(first.snapshot())
    seen = [one.apply(frame_of({FAR: OCCUPIED}, x=0.2), FRAME_NS).grid.label for one in (first, second)]
    np.testing.assert_array_equal(*seen)
    assert second.snapshot() == first.snapshot()
