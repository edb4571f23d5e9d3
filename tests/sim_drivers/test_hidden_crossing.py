"""Two walkers who cross before a standing robot: the nearer hides the other, they never touch, nobody reaches the robot."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from sim_drivers.scenarios.corridor import START
from sim_drivers.scenarios.hidden_crossing import HiddenCrossing, HiddenCrossingSettings

SCENES = [HiddenCrossing(HiddenCrossingSettings()).draw(seed) for seed in range(10)]
TIMES_S = np.arange(0.0, 8.0, 0.02)


def offsets(mover):
    """Where a walker is, from the robot, at all times, shape (times, 2)."""
    poses = [mover.pose_at(time_s) for time_s in TIMES_S]
    return np.array([(pose.x - START.x, pose.y - START.y) for pose in poses])


@pytest.mark.parametrize("scene", SCENES)
def test_the_nearer_walker_hides_the_farther_and_they_never_touch(scene):
    near, far = (offsets(mover) for mover in scene.movers)
    radius_m = scene.movers[0].shape.bounding_radius_m
    assert np.linalg.norm(near - far, axis=1).min() > 2 * radius_m
    for way in (near, far):
        assert np.linalg.norm(way, axis=1).min() > radius_m + 0.5
        assert way[:, 1].min() < -1.5 < 1.5 < way[:, 1].max()
    bearing, other = (np.arctan2(way[:, 1], way[:, 0]) for way in (near, far))
    half = np.arcsin(radius_m / np.linalg.norm(near, axis=1))
    assert (np.abs(bearing - other) < 0.5 * half).any()


def test_a_seed_is_one_scene_and_others_differ():
    again = HiddenCrossing(HiddenCrossingSettings()).draw(3)
    for drawn, same, other in zip(SCENES[3].movers, again.movers, SCENES[4].movers, strict=True):
        np.testing.assert_array_equal(drawn.keyframes, same.keyframes)
        assert not np.array_equal(drawn.keyframes, other.keyframes)


def test_ways_that_walk_into_the_robot_are_refused():
    with pytest.raises(ValidationError, match="near_m"):
        HiddenCrossingSettings(near_m=0.1)
    assert math.isclose(SCENES[0].map_from_start.x, START.x)
