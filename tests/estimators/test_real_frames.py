"""Recorded depth frames: near the camera the grid shows what the raw depth shows and nothing else, at every setting.

The frames' intrinsics were not recorded; they are taken for a D435's usual ones.  The camera is taken to stand level and still.
"""

from pathlib import Path

import numpy as np
import pytest

from drivers.interface.seeds import stream
from runtime import yaml_files
from runtime.evaluations.frame_phantoms import cells_of, grids, occupied_within, phantoms, read_frames, returns
from runtime.evaluations.perception_evaluation import FramesSection

EXPERIMENT = yaml_files.read(yaml_files.find("perception", "experiments"), "experiments")
SECTION = FramesSection.model_validate(EXPERIMENT["frames"])
FRAMES = read_frames(Path(__file__).parents[1] / "data" / "realsense_depth")


def test_every_kind_of_front_end_and_memory_is_among_the_settings():
    assert len(SECTION.settings) == 15


@pytest.mark.parametrize("keys", SECTION.settings.values(), ids=SECTION.settings)
def test_near_the_camera_nothing_is_occupied_that_raw_depth_does_not_show(keys):
    found = phantoms(FRAMES, SECTION.camera, keys, SECTION.within_m)
    assert (found.frames, found.phantom_cells) == (2, 0)
    assert found.occupied_cells > 50


@pytest.mark.parametrize("keys", SECTION.settings.values(), ids=SECTION.settings)
def test_an_obstacle_put_into_a_real_frame_is_shown_at_once_at_every_setting(keys):
    """A pillar of 0.2 m before the recorded scene, with the scene's own holes."""
    image, random = FRAMES[1].copy(), stream(0, "pillar")
    pillar = image[:, 300:360]
    pillar[pillar > 0] = random.normal(1200.0, 4.0, np.count_nonzero(pillar)).astype(np.uint16)
    *_, grid = grids((FRAMES[0], image), SECTION.camera, keys)
    put = {(column, row) for column in (23, 24) for row in range(-2, 1)}
    assert len(occupied_within(grid, SECTION.within_m) & put) >= 3


def test_what_one_frame_shows_another_does_not():
    """Or the judge could not find a phantom."""
    keys, low_m, high_m = next(iter(SECTION.settings.values())), -0.1, 0.1
    grid = next(grids(FRAMES[:1], SECTION.camera, keys))
    assert occupied_within(grid, SECTION.within_m) - cells_of(returns(FRAMES[1], SECTION.camera, low_m, high_m), 0.05)
