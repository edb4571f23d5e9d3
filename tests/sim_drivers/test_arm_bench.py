import math

import numpy as np
import pytest

from sim_drivers.scenarios.arm_bench import ArmBench
from sim_drivers.world import MujocoWorld, WorldSettings


@pytest.mark.parametrize("speed_m_s", [0.05, -0.1])
def test_the_belt_carries_its_boxes_its_own_way(speed_m_s):
    scene = ArmBench(ArmBench.Settings(belt_speed_m_s=speed_m_s)).draw(3)
    (conveyor,) = scene.conveyors
    world = MujocoWorld(scene, WorldSettings())
    world.compile()
    world.step_to(500_000_000)
    before = np.array([world.data.body(box.name).xpos for box in conveyor.items])
    world.step_to(4_500_000_000)
    moved = np.array([world.data.body(box.name).xpos for box in conveyor.items]) - before
    np.testing.assert_allclose(moved, np.tile([0.0, 4.0 * speed_m_s, 0.0], (3, 1)), atol=2e-3)
    np.testing.assert_allclose(before[:, 2], 0.15 + 0.05, atol=2e-3)  # on the belt, not in it


def test_the_seed_places_the_boxes_on_the_belt():
    settings = ArmBench.Settings(lateral_m=0.1, boxes=5)
    places = [[box.map_from_shape for box in ArmBench(settings).draw(seed).conveyors[0].items] for seed in range(5)]
    assert len({tuple(place.x for place in drawn) for drawn in places}) == 5
    for drawn in places:
        assert all(abs(place.x - settings.belt_x_m) <= settings.lateral_m for place in drawn)
        assert np.allclose(np.diff([place.y for place in drawn]), settings.spacing_m)
        assert all(math.isclose(place.yaw, math.pi / 2) for place in drawn)
