"""Depth to labels: against a slow reference, on scenes with known answers, and on frames that are not sound."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.interface.geometry import SE2, SE3
from drivers.interface.samples import Intrinsics, frozen_array
from drivers.interface.seeds import stream
from estimators.belief import FREE, OCCUPIED, UNKNOWN
from estimators.grid.depth_grid import DepthGrid, DepthGridSettings, is_sound
from tests.estimators.label_reference import labels
from tests.estimators.scenes import SMALL, Floor, Pillar, Wall, frame, level_camera

CELL_M = 0.05
ORIGIN = SE2()
FULL = Intrinsics(848, 480, 434.27, 434.27, 431.77, 240.45)


def label_at(grid, x, y):
    row, column = grid.lattice.cell_of(np.array([[x, y]]))
    return grid.label[row[0], column[0]]


def grid_of(frame_, pose=ORIGIN, **settings):
    return DepthGrid(DepthGridSettings(**settings), CELL_M).label(frame_, pose).grid


def spoiled(seed):
    """Noise, holes and outliers."""
    random = stream(seed, "spoil")

    def spoil(depth):
        noisy = np.where(random.random(depth.shape) < 0.1, random.uniform(0.1, 5.0, depth.shape), depth)
        noisy = noisy + random.normal(0.0, 0.02, depth.shape)
        return np.where(random.random(depth.shape) < 0.15, np.inf, np.maximum(noisy, 0.0))

    return spoil


@settings(max_examples=40)
@given(
    seed=st.integers(0, 10_000),
    pitch=st.floats(-0.5, 0.5),
    roll=st.floats(-0.4, 0.4),
    x=st.floats(-3.0, 3.0),
    yaw=st.floats(-math.pi, math.pi),
)
def test_equals_the_slow_reference(seed, pitch, roll, x, yaw):
    random = stream(seed, "scene")
    # Depth is in whole millimetres: a camera on a whole one would put returns exactly between two cells, where rounding decides.
    pose, camera = SE2(x, 0.3, yaw), level_camera(0.4, pitch, roll, x_m=0.1003)
    pillars = [Pillar(x + r * math.cos(a), 0.3 + r * math.sin(a), 0.12, 0.5) for r, a in random.uniform(0.5, 1.5, (3, 2))]
    scene = [Floor(), *pillars, Wall(yaw + 0.3, x * math.cos(yaw + 0.3) + 0.3 * math.sin(yaw + 0.3) + 1.0)]
    k = Intrinsics(28, 20, 16.0, 15.0, 13.2, 9.7)
    seen = frame(scene, pose, camera, k, spoil=spoiled(seed))
    how = DepthGridSettings(range_max_m=1.4, slab_low_m=-0.2, hits_min=1, component_cells_min=2)
    grid = DepthGrid(how, CELL_M).label(seen, pose).grid
    np.testing.assert_array_equal(grid.label, labels(seen, pose, how, grid.lattice))


@pytest.mark.parametrize("k", [SMALL, FULL])
def test_a_wall_ahead(k):
    grid = grid_of(frame([Floor(), Wall(0.0, 1.52)], k=k))
    for y in np.arange(-1.2, 1.2, CELL_M):
        assert label_at(grid, 1.52, y) == OCCUPIED
        assert label_at(grid, 1.45, y) == FREE
        assert label_at(grid, 1.62, y) == UNKNOWN
        assert label_at(grid, 2.40, y) == UNKNOWN
    assert label_at(grid, -0.2, 0.0) == UNKNOWN
    assert label_at(grid, 0.5, 0.9) == UNKNOWN  # beside the view


def test_a_pillar_hides_what_is_behind_and_nothing_else():
    grid = grid_of(frame([Floor(), Pillar(1.2, 0.2, 0.1), Wall(0.0, 2.02)]))
    assert label_at(grid, 1.2 - 0.09, 0.2 - 0.02) == OCCUPIED
    for distance in (1.4, 1.7, 2.0):
        assert label_at(grid, distance, distance * 0.2 / 1.2) == UNKNOWN
    assert label_at(grid, 2.02, -0.6) == OCCUPIED
    assert label_at(grid, 1.8, 0.75) == FREE


def test_the_wall_of_a_corridor_does_not_hide_itself():
    grid = grid_of(frame([Wall(math.pi / 2, 0.62), Wall(-math.pi / 2, 0.62), Wall(0.0, 5.0)], k=FULL))
    for x in np.arange(0.75, 2.3, CELL_M):
        assert label_at(grid, x, 0.62) == OCCUPIED
        assert label_at(grid, x, -0.62) == OCCUPIED
        assert label_at(grid, x, 0.0) == FREE
        assert label_at(grid, x, 0.85) == UNKNOWN


def test_an_oblique_wall_has_no_holes():
    for bearing in np.radians([-65.0, -40.0, -12.0, 27.0, 52.0, 71.0]):
        wall = Wall(bearing, 0.8)
        grid = grid_of(frame([wall], k=FULL))
        along = np.array([-math.sin(bearing), math.cos(bearing)])
        for s in np.arange(-2.0, 2.0, 0.02):
            x, y = 0.8 * np.array([math.cos(bearing), math.sin(bearing)]) + s * along
            if x > 0.4 and abs(y) < 0.9 * x and math.hypot(x, y) < 2.4:
                rows, columns = grid.lattice.cell_of(np.array([[x, y]]))
                around = grid.label[rows[0] - 1 : rows[0] + 2, columns[0] - 1 : columns[0] + 2]
                assert (around == OCCUPIED).any()


def test_floor_proves_free_as_far_as_its_rays_stay_in_the_slab():
    camera = level_camera(height_m=0.4)
    k = SMALL
    grid = grid_of(frame([Floor()], base_from_optical=camera, far_m=2.0))
    lowest_row = math.floor(k.cy + 0.4 * k.fy / 2.0) + 1  # the farthest floor in range, 2 m of depth
    reach = 0.1 * k.fy / (lowest_row - k.cy)  # where its ray sinks through the slab
    assert 0.4 < reach < 0.55
    assert label_at(grid, reach - CELL_M, 0.0) == FREE
    assert label_at(grid, reach + CELL_M, 0.0) == UNKNOWN
    assert not (grid.label == OCCUPIED).any()


def test_a_tilted_camera_sees_the_same_wall():
    for pitch, roll in ((0.15, 0.0), (-0.1, 0.0), (0.0, 0.2), (0.1, -0.15)):
        grid = grid_of(frame([Floor(), Wall(0.0, 1.52)], base_from_optical=level_camera(0.4, pitch, roll)))
        assert label_at(grid, 1.52, 0.0) == OCCUPIED
        assert label_at(grid, 1.45, 0.0) == FREE
        assert (grid.label[:, : grid.lattice.columns // 2] != OCCUPIED).all()


def test_no_depth_is_unknown_never_far():
    nothing = frame([], far_m=6.0)
    assert (grid_of(nothing).label == UNKNOWN).all()
    saturated = replace(nothing, depth=np.full_like(nothing.depth, 65535))
    assert (grid_of(saturated).label == UNKNOWN).all()


def test_a_return_beyond_the_range_proves_free_up_to_it():
    grid = grid_of(frame([Wall(0.0, 5.0)]), range_max_m=2.5)
    assert label_at(grid, 2.45, 0.0) == FREE
    assert not (grid.label == OCCUPIED).any()


def test_stray_returns_make_no_obstacle():
    def spoil(depth):
        depth[40:48, 60] = 1.0  # eight returns in one cell and its neighbour
        return depth

    grid = grid_of(frame([Wall(0.0, 2.0)], spoil=spoil))
    occupied = np.argwhere(grid.label == OCCUPIED)
    assert (grid.lattice.centres(occupied[:, 0], occupied[:, 1])[:, 0] > 1.9).all()


@pytest.mark.parametrize("distance", [0.8, 1.5, 2.0, 2.4])
def test_a_walker_is_never_lost(distance):
    random = stream(7, "walker")
    focal = 160 / (2.0 * math.tan(math.radians(60.0)))  # the paper's 120 degrees, the coarsest pixels in use
    k = Intrinsics(160, 90, focal, focal, 79.5, 44.5)
    for _ in range(20):
        bearing = random.uniform(-0.9, 0.9)
        x, y = distance * math.cos(bearing), distance * math.sin(bearing)

        error = 0.002 * distance  # a D455's: grows with the square of the range

        def spoil(depth, error=error):
            return np.where(random.random(depth.shape) < 0.05, np.inf, depth * (1.0 + error * random.normal(size=depth.shape)))

        grid = grid_of(frame([Floor(), Pillar(x, y, 0.15)], k=k, spoil=spoil))
        assert (grid.label == OCCUPIED).sum() >= 3


def test_moving_by_whole_cells_moves_the_lattice_only():
    scene = [Floor(), Pillar(1.2, 0.2, 0.1), Wall(0.3, 2.0)]
    seen = frame(scene)
    here = grid_of(seen, SE2(0.011, 0.013, 0.4))
    there = grid_of(seen, SE2(0.011 + 7 * CELL_M, 0.013 - 11 * CELL_M, 0.4))
    np.testing.assert_array_equal(here.label, there.label)
    assert there.lattice.x_m - here.lattice.x_m == pytest.approx(7 * CELL_M)
    assert there.lattice.y_m - here.lattice.y_m == pytest.approx(-11 * CELL_M)


def test_turning_by_a_right_angle_turns_the_labels():
    seen = frame([Floor(), Pillar(1.2, 0.2, 0.1)])
    ahead = grid_of(seen, SE2(0.025, 0.025, 0.0))
    left = grid_of(seen, SE2(0.025, 0.025, math.pi / 2.0))
    turned = np.rot90(ahead.label, k=-1)  # rows run along y, so this turns x towards y
    assert (turned != left.label).mean() < 0.005  # points that lie on cell borders fall either way


def test_blind_where_the_camera_looks_but_is_too_near():
    seen = DepthGrid(DepthGridSettings(blind_range_m=0.6), CELL_M).label(frame([]), SE2())
    rows, columns = np.nonzero(seen.blind)
    x, y = seen.grid.lattice.centres(rows, columns).T
    assert x.max() == pytest.approx(0.575)
    assert (np.abs(y) <= x * (80.5 / 82.0) + 0.03).all()
    assert len(x) == pytest.approx(0.6 * 0.6 * (79.1 + 80.9) / 2 / 82.0 / CELL_M**2, rel=0.1)


def test_it_is_not_blind_where_every_column_of_a_cell_sees_past_it():
    assert not DepthGrid(DepthGridSettings(), CELL_M).label(frame([Floor()]), SE2()).blind.any()
    seen = DepthGrid(DepthGridSettings(range_min_m=0.6), CELL_M).label(frame([Floor(), Pillar(0.5, 0.0, 0.06)]), SE2())
    rows, columns = np.nonzero(seen.blind)
    x, y = seen.grid.lattice.centres(rows, columns).T
    shadow = np.hypot(x, y) * np.sin(np.abs(np.arctan2(y, x)) - math.asin(0.06 / 0.5))  # off the cone behind the pillar
    assert (shadow < 0.6 * CELL_M * math.sqrt(2.0)).all()
    assert seen.blind[seen.grid.lattice.cell_of(np.array([[0.45, 0.0], [0.5, 0.04], [0.5, -0.04]]))].all()


def test_frames_that_are_not_sound():
    good = frame([Wall(0.0, 1.5)])
    assert is_sound(good)
    assert not is_sound(replace(good, base_from_optical=SE3(x=math.nan)))
    assert not is_sound(replace(good, base_from_optical=SE3(qw=0.5)))
    assert not is_sound(replace(good, depth=good.depth[:, :80]))
    assert not is_sound(replace(good, depth=good.depth.astype(np.float32)))
    assert not is_sound(replace(good, depth_unit_m=0.0))
    assert not is_sound(replace(good, intrinsics=replace(good.intrinsics, fx=math.inf)))


def test_the_answer_does_not_depend_on_how_the_image_lies_in_memory():
    seen = frame([Floor(), Wall(0.2, 1.5)])
    strided = np.zeros((180, 320), dtype=np.uint16)
    strided[::2, ::2] = seen.depth
    np.testing.assert_array_equal(grid_of(seen).label, grid_of(replace(seen, depth=strided[::2, ::2])).label)
    assert frozen_array(seen.depth) is seen.depth
