"""Range scans give the same labels as depth: hits, free ground, shadows, and beams that say nothing."""

import math
from dataclasses import replace

import numpy as np

from drivers.interface.geometry import SE2
from drivers.interface.samples import RangeScan, Stamp
from estimators.belief import FREE, OCCUPIED, UNKNOWN
from estimators.grid.scan_grid import ScanGrid, ScanGridSettings, is_sound

BEAMS = 360
ANGLES = -math.pi + np.arange(BEAMS) * (2.0 * math.pi / BEAMS)


def scan_of(ranges, range_max_m=8.0):
    return RangeScan(Stamp(0, 0, 0), -math.pi, 2.0 * math.pi / BEAMS, np.asarray(ranges, dtype=float), range_max_m)


def label_at(grid, x, y):
    return grid.label[grid.lattice.cell_of(np.array([[x, y]]))][0]


def grid_of(scan, pose, **settings):
    return ScanGrid(ScanGridSettings(**settings), 0.05).label(scan, pose).grid


def test_a_round_room():
    pose = SE2(1.0, -2.0, 0.8)
    grid = grid_of(scan_of(np.full(BEAMS, 1.5)), pose)
    rows, columns = np.indices(grid.label.shape)
    centres = grid.lattice.centres(rows.ravel(), columns.ravel())
    distance = np.hypot(*(centres - [pose.x, pose.y]).T).reshape(grid.label.shape)
    assert (grid.label[distance < 1.4] == FREE).mean() > 0.97  # lines of cells from one cell leave a few out
    assert not (grid.label[distance < 1.4] == OCCUPIED).any()
    assert (grid.label[distance > 1.6] == UNKNOWN).all()
    angles = np.arange(0.0, 2.0 * math.pi, 0.05)
    wall = np.array([pose.x, pose.y]) + 1.5 * np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    assert (grid.label[grid.lattice.cell_of(wall)] == OCCUPIED).mean() > 0.95


def test_the_heading_turns_the_scan():
    ranges = np.full(BEAMS, np.nan)
    ranges[np.abs(ANGLES) < 0.1] = 1.0
    assert label_at(grid_of(scan_of(ranges), SE2(0.0, 0.0, math.pi / 2.0)), 0.0, 1.0) == OCCUPIED


def test_no_return_is_free_up_to_the_range_and_an_invalid_one_unknown():
    ranges = np.where(ANGLES > 0.0, np.inf, np.nan)
    grid = grid_of(scan_of(ranges, range_max_m=2.0), SE2(), range_max_m=2.5)
    assert label_at(grid, 0.0, 1.9) == FREE
    assert label_at(grid, 0.0, 2.2) == UNKNOWN
    assert label_at(grid, 0.0, -1.0) == UNKNOWN


def test_a_return_beyond_the_range_is_free_up_to_it():
    grid = grid_of(scan_of(np.full(BEAMS, 4.0)), SE2(), range_max_m=2.5)
    assert label_at(grid, 2.3, 0.0) == FREE
    assert not (grid.label == OCCUPIED).any()


def test_scans_that_are_not_sound():
    good = scan_of(np.ones(BEAMS))
    assert is_sound(good)
    assert not is_sound(replace(good, angle_min_rad=math.nan))
    assert not is_sound(replace(good, range_max_m=-1.0))
    assert not is_sound(replace(good, range_m=np.ones((2, 2))))
