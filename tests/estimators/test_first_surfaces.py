"""What may be in a line's way, against the lines walked cell by cell."""

import numpy as np
import pytest

from estimators.grid.first_surfaces import first_surfaces, may_meet
from tests.estimators.label_reference import line


@pytest.mark.parametrize(("seed", "share"), [(0, 0.005), (1, 0.02), (2, 0.1), (3, 0.3)])
def test_no_line_that_meets_a_surface_is_taken_for_free(seed, share):
    rng = np.random.default_rng(seed)
    occupied = (rng.random((31, 37)) < share).astype(np.uint8)
    start = tuple(rng.integers(0, 31, 2).tolist())
    first = first_surfaces(occupied, *start)
    for end in np.ndindex(occupied.shape):
        meets = any(occupied[cell] for cell in line(start, end)[:-1])
        assert may_meet(first, end[0] - start[0], end[1] - start[1]) or not meets


def test_beside_and_before_a_surface_lines_are_known_to_be_free():
    occupied = np.zeros((41, 41), np.uint8)
    occupied[30, 15:26] = 1  # a wall, ten rows up
    first = first_surfaces(occupied, 20, 20)
    assert may_meet(first, 15, 0)
    assert may_meet(first, 20, 5)
    assert not may_meet(first, 10, 0)  # the wall itself is not in its own way
    assert not may_meet(first, 15, 14)
    assert not may_meet(first, -15, 0)
    assert not may_meet(first, 0, 15)


def test_nothing_is_free_of_a_surface_at_the_start():
    occupied = np.zeros((9, 9), np.uint8)
    occupied[4, 4] = 1
    first = first_surfaces(occupied, 4, 4)
    ways = [(row - 4, column - 4) for row, column in np.ndindex(9, 9)]
    assert all(may_meet(first, *way) for way in ways if way != (0, 0))
    assert not may_meet(first, 0, 0)
