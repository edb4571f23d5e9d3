"""The two layers: what they keep beyond view, for how long, and within which bounds."""

import numpy as np
import pytest

from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from drivers.interface.seeds import stream
from estimators.belief import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from estimators.clearance import ClearanceEstimator, ClearanceSettings
from estimators.grid.labelling import FrameLabels
from estimators.memory.field_memory import FieldMemory, FieldMemorySettings
from estimators.memory.grid_memory import GridMemory, GridMemorySettings
from estimators.memory.rolling import lattice_around
from tests.estimators.scenes import MS, ORIGIN

CELL_M, WINDOW_M, RADIUS_M = 0.05, 3.0, 0.12
SECOND = 1000 * MS
PLACE = (0.52, 0.02)


def memory(**settings):
    return FieldMemory(FieldMemorySettings(**{"extent_m": 5.0, **settings}), WINDOW_M, CELL_M, RADIUS_M)


def rolling():
    return GridMemory(GridMemorySettings(), WINDOW_M, CELL_M, RADIUS_M)


def frame_of(cells, blind=(), x=0.0, y=0.0, side=61):
    """A frame that labels the cells given as {(x, y): label}, and nothing else."""
    lattice = lattice_around(x, y, CELL_M, side, side)
    label, dark = np.full((side, side), UNKNOWN, dtype=np.uint8), np.zeros((side, side), dtype=np.bool_)
    for (cx, cy), value in dict(cells).items():
        label[lattice.cell_of(np.array([[cx, cy]]))] = value
    for cx, cy in blind:
        dark[lattice.cell_of(np.array([[cx, cy]]))] = True
    return FrameLabels(OccupancyGrid(lattice, label), dark)


def around(value, place=PLACE):
    """All cells of the layer's cell that holds a place."""
    return {(place[0] + dx, place[1] + dy): value for dx in (0.0, CELL_M) for dy in (0.0, CELL_M)}


def at(memory_, x, y):
    grid = memory_.grid
    return grid.label[grid.lattice.cell_of(np.array([[x, y]]))][0]


def last_occupied_s(memory_, start_ns, step_ns, limit_s=400.0, blind=()):
    """How long the place stays occupied when frames come that do not see it."""
    for now in range(start_ns, start_ns + round(limit_s * SECOND), step_ns):
        memory_.merge(frame_of({}, blind), now, ORIGIN)
        if at(memory_, *PLACE) != OCCUPIED:
            return (now - step_ns - start_ns) / SECOND
    return limit_s


def test_it_starts_unknown_but_for_the_ground_under_the_robot():
    label = memory().grid.label
    assert label.shape == (60, 60)
    assert (label == FREE).sum() == pytest.approx(np.pi * RADIUS_M**2 / CELL_M**2, abs=6)
    assert not (label == OCCUPIED).any()


@pytest.mark.parametrize("period_ns", [33 * MS, 200 * MS])
def test_retention_is_per_two_tenths_of_a_second_whatever_the_frame_rate(period_ns):
    static, dynamic = memory(static_retention=0.98), memory()
    static.merge(frame_of({PLACE: OCCUPIED}), 0, ORIGIN)
    assert last_occupied_s(static, 0, period_ns) == pytest.approx(0.2 * np.log(0.3) / np.log(0.98), abs=period_ns / SECOND)
    dynamic.merge(frame_of(around(FREE)), 0, ORIGIN)
    dynamic.merge(frame_of({PLACE: OCCUPIED}), SECOND, ORIGIN)
    assert last_occupied_s(dynamic, SECOND, period_ns) == pytest.approx(0.2 * np.log(0.3) / np.log(0.5), abs=period_ns / SECOND)


def test_a_wall_outlasts_two_minutes_out_of_view():
    grid = memory()
    grid.merge(frame_of({PLACE: OCCUPIED}), 0, ORIGIN)
    grid.merge(frame_of({}), 120 * SECOND, ORIGIN)
    assert at(grid, *PLACE) == OCCUPIED


@pytest.mark.parametrize("period_ns", [33 * MS, 200 * MS])
def test_what_stays_where_it_came_grows_static(period_ns):
    grid = memory()
    grid.merge(frame_of(around(FREE)), 0, ORIGIN)
    for now in range(period_ns, 6 * SECOND, period_ns):
        grid.merge(frame_of({PLACE: OCCUPIED}), now, ORIGIN)
        assert grid.remembered.came.any() == (now < 1.5 * SECOND) or abs(now - 1.5 * SECOND) < 0.3 * SECOND
    assert last_occupied_s(grid, now, SECOND, 60.0) > 30.0


def test_seen_free_is_free_at_once():
    grid = memory()
    grid.merge(frame_of({PLACE: OCCUPIED}), 0, ORIGIN)
    grid.merge(frame_of(around(FREE)), SECOND, ORIGIN)
    assert at(grid, *PLACE) == FREE


def test_of_a_layer_cell_only_the_parts_last_seen_occupied_are():
    grid, neighbour = memory(), (PLACE[0] + CELL_M, PLACE[1])
    grid.merge(frame_of({PLACE: OCCUPIED, neighbour: FREE}), 0, ORIGIN)
    grid.merge(frame_of({}), SECOND, ORIGIN)
    assert (at(grid, *PLACE), at(grid, *neighbour)) == (OCCUPIED, FREE)


def test_a_part_that_is_still_seen_free_does_not_hold_the_other():
    grid, neighbour = memory(), (PLACE[0] + CELL_M, PLACE[1])
    grid.merge(frame_of(around(FREE)), 0, ORIGIN)
    grid.merge(frame_of({PLACE: OCCUPIED}), SECOND, ORIGIN)
    grid.merge(frame_of({neighbour: FREE}), 2 * SECOND, ORIGIN)
    assert at(grid, *PLACE) == UNKNOWN


def test_in_the_blind_zone_a_wall_persists_until_every_column_sees_past_it():
    grid = memory(static_retention=0.5)
    grid.merge(frame_of({PLACE: OCCUPIED}), 0, ORIGIN)
    assert last_occupied_s(grid, SECOND // 10, SECOND // 10, 20.0, blind=[PLACE]) == 20.0
    grid.merge(frame_of({PLACE: FREE}, blind=[PLACE]), 21 * SECOND, ORIGIN)
    assert at(grid, *PLACE) == OCCUPIED
    grid.merge(frame_of({PLACE: FREE}), 22 * SECOND, ORIGIN)
    assert at(grid, *PLACE) == FREE


@pytest.mark.parametrize("build", [memory, rolling])
def test_what_came_is_told_from_what_stood_there_and_open_ground_from_the_edge_of_what_is_known(build):
    grid, wall = build(), (0.92, 0.02)
    ground = {(x, y): FREE for x in np.arange(0.325, 0.75, CELL_M) for y in np.arange(-0.275, 0.35, CELL_M)}
    grid.merge(frame_of(ground), 0, ORIGIN)
    grid.merge(frame_of({PLACE: OCCUPIED, wall: OCCUPIED}), SECOND, ORIGIN)
    known = grid.remembered
    here, there, edge = (known.grid.lattice.cell_of(np.array([place])) for place in (PLACE, wall, (0.725, 0.02)))
    assert known.came.sum() == 1
    assert (known.came[here][0], known.came[there][0]) == (True, False)
    assert (known.open[here][0], known.open[there][0], known.open[edge][0]) == (True, False, False)


def test_back_in_the_window_what_left_it_is_remembered_as_far_as_the_layers_reach():
    grid = memory(extent_m=8.0)
    grid.merge(frame_of({PLACE: OCCUPIED}), 0, ORIGIN)
    grid.merge(frame_of({}, x=2.4), SECOND, SE2(2.4, 0.0, 0.0))
    assert not (grid.grid.label == OCCUPIED).any()
    grid.merge(frame_of({}), 2 * SECOND, ORIGIN)
    assert at(grid, *PLACE) == OCCUPIED
    grid.merge(frame_of({}), 3 * SECOND, SE2(9.0, -7.0, 0.0))
    grid.merge(frame_of({}), 4 * SECOND, ORIGIN)
    assert at(grid, *PLACE) == UNKNOWN


def test_a_wall_stays_where_it_is_in_odom_wherever_the_robot_goes():
    grid, random = memory(extent_m=3.6), stream(1, "walk")
    grid.merge(frame_of({PLACE: OCCUPIED}), 0, ORIGIN)
    for step in range(200):
        grid.follow(SE2(*random.uniform(-0.8, 0.8, 2), 0.0)) if step % 2 else grid.merge(
            frame_of({}), step * 100 * MS, SE2(*random.uniform(-0.3, 0.3, 2), 0.0)
        )
        label = grid.grid.label
        assert at(grid, *PLACE) in {OCCUPIED, FREE}  # free only where the robot has stood
        assert (label == OCCUPIED).sum() <= 1


def test_a_long_way_takes_no_more_memory():
    grid = memory()
    sizes = set()
    for step in range(400):
        pose = SE2(0.7 * step, 0.3 * step, 0.0)
        grid.merge(frame_of({(pose.x + 0.5, pose.y): OCCUPIED}, x=pose.x, y=pose.y), step * SECOND, pose)
        assert at(grid, pose.x + 0.5, pose.y) == OCCUPIED
        sizes.add(len(grid.snapshot()))
    assert len(sizes) == 1


def test_what_fades_or_comes_into_view_is_no_motion():
    """The rate counts only on cells known now and before; a walker forgotten and a wall found change what is known."""
    grid, clearance = memory(), ClearanceEstimator(ClearanceSettings())
    grid.merge(frame_of(around(FREE)), 0, ORIGIN)
    for now in range(SECOND, 3 * SECOND, SECOND // 10):
        cells = {PLACE: OCCUPIED} if now < 2 * SECOND else {(0.9, y): OCCUPIED for y in np.arange(-0.5, 0.5, CELL_M)}
        grid.merge(frame_of(cells), now, ORIGIN)
        field = clearance.update(grid.grid, now)
    assert not field.overlap[field.lattice.cell_of(np.array([PLACE]))].any()
    assert np.abs(field.rate_m_s).max() < 0.05


def test_layers_that_do_not_fit_are_refused():
    with pytest.raises(ConfigurationError, match=r"multiple of estimator\.cell_m"):
        memory(layer_cell_m=0.12)
    with pytest.raises(ConfigurationError, match="extent_m"):
        memory(extent_m=3.1)


def test_restored_it_goes_on_identically():
    first, second = memory(), memory()
    first.merge(frame_of(around(FREE)), 0, ORIGIN)
    first.merge(frame_of({PLACE: OCCUPIED}), SECOND, SE2(0.9, 0.4, 0.1))
    second.restore(first.snapshot())
    for one in (first, second):
        one.merge(frame_of({}), 1300 * MS, SE2(1.4, 0.2, 0.1))
    assert second.grid.lattice == first.grid.lattice
    assert second.snapshot() == first.snapshot()


@pytest.mark.parametrize("layer_cell_m", [0.05, 0.15])
def test_layers_of_other_cells_keep_the_same_labels_while_they_are_seen(layer_cell_m):
    random, fine, coarse = stream(2, "labels"), memory(), memory(layer_cell_m=layer_cell_m)
    for step in range(12):
        label = random.choice(np.array([FREE, OCCUPIED, UNKNOWN], dtype=np.uint8), (61, 61))
        frame = FrameLabels(OccupancyGrid(lattice_around(0.0, 0.0, CELL_M, 61, 61), label), np.zeros((61, 61), dtype=np.bool_))
        for one in (fine, coarse):
            one.merge(frame, step * 50 * MS, ORIGIN)
    np.testing.assert_array_equal(fine.grid.label, coarse.grid.label)
