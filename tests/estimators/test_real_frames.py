"""Recorded depth frames: near the camera the grid shows what the raw depth shows and nothing else, at every setting.

The frames' intrinsics were not recorded; they are taken for a D435's usual ones.  The camera is taken to stand level and still.
"""

from itertools import product
from pathlib import Path

import cv2
import numpy as np
import pytest

from drivers.interface.geometry import BODY_FROM_OPTICAL, SE2, SE3
from drivers.interface.samples import DepthFrame, Intrinsics, Stamp
from drivers.interface.seeds import stream
from estimators.belief import OCCUPIED
from estimators.estimator import EstimatorSetup
from estimators.standard import StandardEstimator, StandardSettings
from tests.estimators.scenes import sensed

FRAMES = sorted((Path(__file__).parents[1] / "data" / "realsense_depth").glob("*.png"))
D435 = Intrinsics(640, 480, 383.0, 383.0, 320.0, 240.0)
FRAME_NS, HEIGHT_M, NEAR_M, CELL_M = 33_333_333, 0.4, 1.5, 0.05
STRONG = {"temporal_retention": 0.95, "median_radius_m": 0.1, "opening_radius_m": 0.1, "closing_radius_m": 0.2}
DEPTH = {
    "raw": {},
    "filtered": {"filtered": True},
    "strongly filtered": {"filtered": True, "filter": STRONG},
    "every return counts": {"hits_min": 1, "component_cells_min": 1},
    "high slab": {"slab_low_m": -0.3, "slab_high_m": 0.5, "filtered": True},
}
MEMORY = {
    "rolling": {"kind": "rolling"},
    "layers": {"kind": "layers"},
    "fine layers": {"kind": "layers", "layers": {"layer_cell_m": 0.05}},
}


def read(path):
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def returns(depth, low_m, high_m):
    """Where the raw returns of the slab lie in the plane, shape (n, 2), the camera being at the origin; plain geometry."""
    v, u = np.nonzero(depth)
    z = depth[v, u] * 0.001
    up = -(v - D435.cy) / D435.fy * z
    points = np.stack((z, -(u - D435.cx) / D435.fx * z), axis=1)
    return points[(up >= low_m - 1e-6) & (up <= high_m + 1e-6)]


def cells_of(points):
    return {tuple(cell) for cell in np.floor(points / CELL_M).astype(int).tolist()}


def near_occupied(grid):
    """The occupied cells within reach of the claim, as whole numbers of cells from odom's origin."""
    centres = grid.lattice.centres(*np.nonzero(grid.label == OCCUPIED))
    return cells_of(centres[np.hypot(*centres.T) < NEAR_M])


def run(images, depth, memory):
    """Every frame through a whole estimator that stands still: its grids."""
    settings = StandardSettings(depth=depth, memory=memory, cell_m=CELL_M, tracks="grid")
    estimator = StandardEstimator(settings, EstimatorSetup(0.05, 0.06, SE2(), None))
    for index, image in enumerate(images):
        stamp = Stamp(index * FRAME_NS, index * FRAME_NS, index)
        camera = SE3(0.0, 0.0, HEIGHT_M) @ BODY_FROM_OPTICAL
        belief = estimator.update(sensed((index + 1) * FRAME_NS, index, depth=DepthFrame(stamp, image, 0.001, D435, camera)))
        assert belief.faults == ()
        yield belief.grid


@pytest.mark.parametrize(("depth", "memory"), list(product(DEPTH, MEMORY)))
def test_near_the_camera_nothing_is_occupied_that_raw_depth_does_not_show(depth, memory):
    images, shown = [read(path) for path in FRAMES], set()
    assert len(images) == 2
    for image, grid in zip(images, run(images, DEPTH[depth], MEMORY[memory]), strict=True):
        shown |= cells_of(returns(image, DEPTH[depth].get("slab_low_m", -0.1), DEPTH[depth].get("slab_high_m", 0.1)))
        assert near_occupied(grid) - shown == set()


@pytest.mark.parametrize(("depth", "memory"), list(product(DEPTH, MEMORY)))
def test_an_obstacle_put_into_a_real_frame_is_shown_at_once_at_every_setting(depth, memory):
    """A pillar of 0.2 m before the recorded scene, with the scene's own holes."""
    image, random = read(FRAMES[1]).copy(), stream(0, "pillar")
    pillar = image[:, 300:360]
    pillar[pillar > 0] = random.normal(1200.0, 4.0, np.count_nonzero(pillar)).astype(np.uint16)
    *_, grid = run([read(FRAMES[0]), image], DEPTH[depth], MEMORY[memory])
    put = {(column, row) for column in (23, 24) for row in range(-2, 1)}
    assert len(near_occupied(grid) & put) >= 3
