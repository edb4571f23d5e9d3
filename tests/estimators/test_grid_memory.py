"""The rolling grid: what it overwrites, keeps and forgets."""

import numpy as np
import pytest

from drivers.interface.geometry import SE2
from estimators.belief import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from estimators.grid.labelling import FrameLabels
from estimators.memory.grid_memory import GridMemory, GridMemorySettings
from estimators.memory.rolling import lattice_around, transfer
from tests.estimators.scenes import MS, ORIGIN

CELL_M = 0.05
SECOND = 1000 * MS
RETENTION = {"static_retention_s": 10.0, "dynamic_retention_s": 1.0, "recently_free_s": 3.0, "settle_s": 1.5}


def memory(**settings):
    return GridMemory(GridMemorySettings(**{**RETENTION, **settings}), 3.0, CELL_M, robot_radius_m=0.12)


def frame_of(cells, blind=(), x=0.0, y=0.0, side=41):
    """A frame that labels the cells given as {(x, y): label}, and nothing else."""
    lattice = lattice_around(x, y, CELL_M, side, side)
    label, dark = np.full((side, side), UNKNOWN, dtype=np.uint8), np.zeros((side, side), dtype=np.bool_)
    for (cx, cy), value in dict(cells).items():
        label[lattice.cell_of(np.array([[cx, cy]]))] = value
    for cx, cy in blind:
        dark[lattice.cell_of(np.array([[cx, cy]]))] = True
    return FrameLabels(OccupancyGrid(lattice, label), dark)


def at(memory_, x, y):
    grid = memory_.grid
    return grid.label[grid.lattice.cell_of(np.array([[x, y]]))][0]


def test_it_starts_unknown_but_for_the_ground_under_the_robot():
    label = memory().grid.label
    assert label.shape == (60, 60)
    assert (label == FREE).sum() == pytest.approx(np.pi * 0.12**2 / CELL_M**2, abs=6)
    assert (label == UNKNOWN).sum() == label.size - (label == FREE).sum()


def test_seen_cells_overwrite_and_unseen_ones_stay():
    grid = memory()
    grid.merge(frame_of({(0.5, 0.0): OCCUPIED, (0.4, 0.0): FREE}), 0, ORIGIN)
    grid.merge(frame_of({(0.5, 0.0): FREE}), SECOND, ORIGIN)
    assert (at(grid, 0.5, 0.0), at(grid, 0.4, 0.0)) == (FREE, FREE)


def test_what_always_stood_there_is_kept_for_the_static_retention():
    grid = memory()
    grid.merge(frame_of({(0.5, 0.0): OCCUPIED}), 0, ORIGIN)
    grid.merge(frame_of({}), 10 * SECOND, ORIGIN)
    assert at(grid, 0.5, 0.0) == OCCUPIED
    grid.merge(frame_of({}), 10 * SECOND + 1, ORIGIN)
    assert at(grid, 0.5, 0.0) == UNKNOWN


def test_what_came_to_stand_on_free_ground_is_soon_forgotten_unseen():
    grid = memory()
    grid.merge(frame_of({(0.5, 0.0): FREE}), 0, ORIGIN)
    grid.merge(frame_of({(0.5, 0.0): OCCUPIED}), SECOND, ORIGIN)
    grid.merge(frame_of({}), 2 * SECOND, ORIGIN)
    assert at(grid, 0.5, 0.0) == OCCUPIED
    grid.merge(frame_of({}), 2 * SECOND + 1, ORIGIN)
    assert at(grid, 0.5, 0.0) == UNKNOWN


def test_what_stays_long_enough_counts_as_static():
    grid = memory()
    grid.merge(frame_of({(0.5, 0.0): FREE}), 0, ORIGIN)
    for tenth in range(10, 26):
        grid.merge(frame_of({(0.5, 0.0): OCCUPIED}), tenth * SECOND // 10, ORIGIN)
    grid.merge(frame_of({}), 9 * SECOND, ORIGIN)
    assert at(grid, 0.5, 0.0) == OCCUPIED


def test_what_was_free_long_ago_does_not_make_a_wall_dynamic():
    grid = memory()
    grid.merge(frame_of({(0.5, 0.0): FREE}), 0, ORIGIN)
    grid.merge(frame_of({(0.5, 0.0): OCCUPIED}), 4 * SECOND, ORIGIN)
    grid.merge(frame_of({}), 8 * SECOND, ORIGIN)
    assert at(grid, 0.5, 0.0) == OCCUPIED


def test_in_the_blind_zone_an_obstacle_persists_until_seen_free():
    grid, place = memory(), (0.3, 0.0)
    grid.merge(frame_of({place: FREE}), 0, ORIGIN)
    grid.merge(frame_of({place: OCCUPIED}), SECOND, ORIGIN)
    for tenth in range(11, 200):
        grid.merge(frame_of({}, blind=[place]), tenth * SECOND // 10, ORIGIN)
    assert at(grid, *place) == OCCUPIED
    grid.merge(frame_of({place: FREE}), 20 * SECOND, ORIGIN)
    assert at(grid, *place) == FREE


def test_in_the_blind_zone_a_ray_that_grazes_an_obstacle_does_not_take_it_away():
    grid, wall = memory(), [(0.3, 0.025), (0.3, -0.025)]
    grid.merge(frame_of(dict.fromkeys(wall, OCCUPIED)), 0, ORIGIN)
    grazed = frame_of({(0.3, 0.075): FREE, wall[0]: FREE}, blind=[*wall, (0.3, 0.075)])
    grid.merge(grazed, SECOND, ORIGIN)
    assert [at(grid, *cell) for cell in wall] == [OCCUPIED, OCCUPIED]
    grid.merge(frame_of(dict.fromkeys(wall, FREE)), 2 * SECOND, ORIGIN)
    assert [at(grid, *cell) for cell in wall] == [FREE, FREE]


def test_the_window_rolls_by_whole_cells_and_forgets_what_leaves_it():
    grid = memory()
    grid.merge(frame_of({(0.52, 0.42): OCCUPIED, (-0.98, 0.02): OCCUPIED}), 0, ORIGIN)
    for moved in (0.512, 0.771):
        grid.merge(frame_of({}), SECOND, SE2(moved, 0.0, 0.0))
        corner = grid.grid.lattice.x_m
        assert corner / CELL_M == pytest.approx(round(corner / CELL_M))
        assert corner + 1.5 <= moved + 1e-9 < corner + 1.5 + CELL_M
        assert at(grid, 0.52, 0.42) == OCCUPIED
    grid.merge(frame_of({}), SECOND, ORIGIN)
    assert at(grid, -0.98, 0.02) == UNKNOWN


def test_the_ground_under_the_robot_is_free():
    grid = memory()
    grid.merge(frame_of({(0.06, 0.0): OCCUPIED, (0.5, 0.0): OCCUPIED}), 0, ORIGIN)
    assert at(grid, 0.06, 0.0) == FREE
    grid.merge(frame_of({}), SECOND, SE2(0.5, 0.0, 0.0))
    assert at(grid, 0.5, 0.0) == FREE


def test_frames_reach_beyond_the_window_without_harm():
    wide = frame_of({(4.0, 4.0): OCCUPIED, (0.6, 0.6): OCCUPIED}, side=201)
    grid = memory()
    grid.merge(wide, 0, ORIGIN)
    assert (grid.grid.label == OCCUPIED).sum() == 1


def test_straying_from_the_middle():
    grid = memory()
    assert not grid.strays(SE2(0.7, 0.0, 0.0))
    assert grid.strays(SE2(0.0, -0.8, 0.0))
    grid.follow(SE2(0.0, -0.8, 0.0))
    assert not grid.strays(SE2(0.0, -0.8, 0.0))


def test_the_grid_given_out_is_a_copy():
    grid = memory()
    before = grid.grid
    grid.merge(frame_of({(0.5, 0.0): OCCUPIED}), 0, ORIGIN)
    assert not (before.label == OCCUPIED).any()
    assert not before.label.flags.writeable


def test_restored_it_goes_on_identically():
    first, second = memory(), memory()
    first.merge(frame_of({(0.5, 0.0): FREE}), 0, ORIGIN)
    first.merge(frame_of({(0.5, 0.0): OCCUPIED}), SECOND, SE2(0.3, 0.2, 0.1))
    second.restore(first.snapshot())
    for one in (first, second):
        one.merge(frame_of({}), 2 * SECOND + 1, SE2(0.4, 0.2, 0.1))
    assert second.grid.lattice == first.grid.lattice
    np.testing.assert_array_equal(second.grid.label, first.grid.label)
    assert second.snapshot() == first.snapshot()


def test_transfer_between_lattices_that_do_not_meet():
    near, far = lattice_around(0.0, 0.0, CELL_M, 5, 5), lattice_around(9.0, 0.0, CELL_M, 5, 5)
    assert (transfer(np.ones((5, 5)), near, far, 7.0) == 7.0).all()
