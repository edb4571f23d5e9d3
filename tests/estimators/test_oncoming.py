"""Who comes on into the blind zone before the camera is carried on in the memory, and nobody else is."""

import numpy as np
import pytest

from drivers.interface.geometry import SE2
from estimators.belief import FREE, OCCUPIED, OccupancyGrid
from estimators.grid.labelling import FrameLabels
from estimators.memory.field_memory import FieldMemory, FieldMemorySettings
from estimators.memory.rolling import lattice_around

CELL_M, PERIOD_S, RADIUS_M, BLIND_M, HIS_M = 0.05, 0.05, 0.12, 0.6, 0.25
LATTICE = lattice_around(0.0, 0.0, CELL_M, 61, 61)
ROWS, COLUMNS = np.indices((61, 61))
X, Y = np.moveaxis(LATTICE.centres(ROWS.ravel(), COLUMNS.ravel()), 1, 0).reshape(2, 61, 61)
BLIND = (np.hypot(X, Y) < BLIND_M) & (np.abs(Y) < X)


def memory(carry_s=1.5):
    return FieldMemory(FieldMemorySettings(extent_m=5.0, carry_s=carry_s), 3.0, CELL_M, RADIUS_M)


def seen(x_m, y_m=0.0):
    """Free ground and the front of a man with his middle there, but nothing in the blind zone."""
    label = np.full((61, 61), FREE, np.uint8)
    front = (np.abs(np.hypot(X - x_m, Y - y_m) - HIS_M) < 0.6 * CELL_M) & (x_m > X)
    label[front & ~BLIND] = OCCUPIED
    return FrameLabels(OccupancyGrid(LATTICE, label), BLIND)


def nearest_m(memory_):
    grid = memory_.grid
    places = grid.lattice.centres(*np.nonzero(grid.label == OCCUPIED))
    return float(np.hypot(*places.T).min()) if len(places) else np.inf


def approach(memory_, speed, until_m, begin_m=1.3):
    """Merge frames while his front comes from `begin_m` to `until_m` at a speed; return the least error of the nearest cell."""
    off = []
    for k in range(round((begin_m - until_m) / (speed * PERIOD_S)) + 1):
        front_m = begin_m - speed * PERIOD_S * k
        memory_.merge(seen(front_m + HIS_M), round((1.0 + PERIOD_S * k) * 1e9), SE2())
        off.append(nearest_m(memory_) - front_m)
    return np.array(off)


@pytest.mark.parametrize("speed", [0.5, 0.8, 1.2])
def test_who_came_on_into_the_blind_zone_comes_on(speed):
    """His front is where he is, to within a cell and what his speed was off by, all the way to the robot's edge."""
    assert np.abs(approach(memory(), speed, RADIUS_M + 0.05)).max() < 1.6 * CELL_M


def test_without_it_he_stands_where_he_was_last_seen():
    assert approach(memory(0.0), 0.8, RADIUS_M + 0.05)[-1] > 0.3


@pytest.mark.parametrize("stands_m", [0.62, 0.8])
def test_who_comes_and_stands_is_not_carried_on(stands_m):
    memory_ = memory()
    approach(memory_, 0.8, stands_m)
    for k in range(40):
        memory_.merge(seen(stands_m + HIS_M), round((3.0 + PERIOD_S * k) * 1e9), SE2())
    assert nearest_m(memory_) > stands_m - 1.5 * CELL_M


def test_after_a_while_and_once_past_he_is_not_carried_on():
    memory_ = memory(carry_s=0.4)
    approach(memory_, 0.8, 0.5)
    for k in range(20):
        memory_.merge(seen(9.0), round((2.05 + PERIOD_S * k) * 1e9), SE2())
    assert nearest_m(memory_) > 0.45  # what was seen of him last, and no more


def test_what_always_stood_there_is_not_carried_on():
    """A wall that the robot drives towards: it was never seen free."""
    memory_ = memory()
    for k in range(30):
        pose, x_m = SE2(0.02 * k, 0.0, 0.0), 1.2 - 0.02 * k  # of the wall, from the robot
        lattice = lattice_around(pose.x, pose.y, CELL_M, 61, 61)
        label = np.full((61, 61), FREE, np.uint8)
        label[(np.abs(X - x_m) < 0.6 * CELL_M) & ~BLIND] = OCCUPIED
        memory_.merge(FrameLabels(OccupancyGrid(lattice, label), BLIND), round((1.0 + PERIOD_S * k) * 1e9), pose)
    grid = memory_.grid
    places = grid.lattice.centres(*np.nonzero(grid.label == OCCUPIED))
    assert places[:, 0].min() > 1.2 - 2.0 * CELL_M


def test_a_restored_memory_goes_on_to_the_bit():
    one, other = memory(), memory()
    approach(one, 0.8, 0.55)
    other.restore(one.snapshot())
    for k in range(6):
        for memory_ in (one, other):
            memory_.merge(seen(0.5 + HIS_M - 0.04 * k), round((2.0 + PERIOD_S * k) * 1e9), SE2())
        assert one.snapshot() == other.snapshot()
