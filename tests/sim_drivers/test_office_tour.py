"""The office tour: every goal can be reached, by whoever waits for the door, and the ways lead around corners."""

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from sim_drivers.scenarios.office_tour import OFFICE_DOOR_X_M, OfficeTour
from sim_drivers.scene import Scene
from sim_drivers.world import MujocoWorld, WorldSettings
from tests.sim_drivers.footprints import cell_of, clearance, gap, outline, same

SEEDS = range(10)
JACKAL_M = 0.34
CELL_M = 0.05
AXES = np.meshgrid(np.arange(-0.5, 14.5, CELL_M), np.arange(-5.8, 5.8, CELL_M))
POINTS = np.stack(AXES, axis=-1)  # (rows, columns, 2)


def drawn(seed: int, **settings: float) -> Scene:
    return OfficeTour(OfficeTour.Settings(**settings)).draw(seed)


def places(scene: Scene) -> list[tuple[float, float]]:
    return [(scene.map_from_start.x, scene.map_from_start.y), *((goal.x_m, goal.y_m) for goal in scene.goals)]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_jackal_fits_from_goal_to_goal(seed: int) -> None:
    scene = drawn(seed)
    _, labels = cv2.connectedComponents((clearance(scene, POINTS) > JACKAL_M).astype(np.uint8), connectivity=4)
    found = {int(labels[cell_of(POINTS, *place)]) for place in places(scene)}
    assert len(found) == 1
    assert found != {0}


def test_no_goal_is_in_sight_of_the_one_before() -> None:
    scene = drawn(0)
    for start, goal in zip(places(scene), places(scene)[1:], strict=False):
        assert clearance(scene, np.linspace(start, goal, 200)).min() < 0.0


@pytest.mark.parametrize("seed", SEEDS)
def test_who_moves_keeps_out_of_what_stands_and_of_the_goals(seed: int) -> None:
    scene = drawn(seed)
    for mover in scene.movers:
        poses = [mover.pose_at(t) for t in np.arange(0.0, 120.0, 0.1)]
        assert clearance(scene, np.array([pose.apply(outline(mover.shape)) for pose in poses])).min() > 0.0
    _, corridor, office = scene.movers
    assert {round(abs(mover.velocity_at(5.0)[0]) + abs(mover.velocity_at(5.0)[1]), 2) for mover in (corridor, office)} <= {
        round(v, 2) for v in np.arange(0.4, 0.81, 0.01)
    }


def test_the_office_door_shuts_the_office() -> None:
    scene = drawn(3)
    door = scene.movers[0]
    doorway = np.column_stack((OFFICE_DOOR_X_M + np.linspace(-0.65, 0.65, 23), np.full(23, -1.32)))
    shut = np.array([(gap(door.shape, door.pose_at(t), doorway) < 0.05).mean() for t in np.arange(0.0, 30.0, 0.05)])
    assert 4.0 - 0.1 <= np.mean(shut == 1.0) * 30.0 < 4.8
    assert 20.0 - 0.1 <= np.mean(shut == 0.0) * 30.0 < 21.0


def test_a_seed_draws_one_scene_and_other_seeds_others() -> None:
    scenes = [drawn(seed) for seed in SEEDS]
    assert all(same(scene, drawn(seed)) for seed, scene in enumerate(scenes))
    assert not any(same(a, b) for k, a in enumerate(scenes) for b in scenes[:k])
    names = [part.name for part in (*scenes[0].static, *scenes[0].movers)]
    assert len(set(names)) == len(names)


def test_the_world_compiles_and_steps() -> None:
    world = MujocoWorld(drawn(1), WorldSettings())
    world.compile()
    world.step_to(1_000_000_000)
    assert world.data.ncon == 0


def test_nonsense_is_refused() -> None:
    with pytest.raises(ValidationError, match="opening_m"):
        OfficeTour.Settings(opening_m=3.0)
    with pytest.raises(ValidationError, match="max_speed_m_s"):
        OfficeTour.Settings(min_speed_m_s=1.0, max_speed_m_s=0.5)
