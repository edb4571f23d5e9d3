from functools import cache

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from runtime import yaml_files
from sim_drivers.scenario import Scenario
from sim_drivers.scenarios.cluttered import Cluttered
from sim_drivers.scenarios.corridor_crossing import CorridorCrossing
from sim_drivers.scenarios.door import Door
from sim_drivers.scenarios.dynamic_hallway import DynamicHallway
from sim_drivers.scenarios.fov_limited import FovLimited
from sim_drivers.scenarios.long_corridor import LongCorridor
from sim_drivers.scenarios.occluded_boundary import OccludedBoundary
from sim_drivers.scenarios.passage_selection import PassageSelection
from sim_drivers.scenarios.static_corridor import StaticCorridor
from sim_drivers.scenarios.walkers import bounce
from sim_drivers.scene import Scene
from sim_drivers.world import MujocoWorld, WorldSettings
from tests.sim_drivers.footprints import cell_of, clearance, ends, gap, lattice, outline, same

SCENARIOS = {
    "static_corridor": StaticCorridor,
    "corridor_crossing": CorridorCrossing,
    "dynamic_hallway": DynamicHallway,
    "occluded_boundary": OccludedBoundary,
    "fov_limited": FovLimited,
    "long_corridor": LongCorridor,
    "cluttered": Cluttered,
    "passage_selection": PassageSelection,
    "door": Door,
}
CONFIGS = (
    *SCENARIOS,
    "dynamic_hallway_four",
    "dynamic_hallway_random",
    "door_swinging",
    "passage_selection_blocked",
)
WALKED = tuple(name for name in CONFIGS if name.split("_")[0] not in {"static", "passage", "door"})
UNSEEDED = ("static_corridor",)
SEEDS = range(10)
ROBOT_M, JACKAL_M, SENSING_M = 0.12, 0.34, 2.5


@cache
def build(config: str) -> Scenario:
    world = yaml_files.read(yaml_files.find(config, "scenarios"), "scenarios")["world"]
    cls = SCENARIOS[world.pop("scenario")]
    return cls(cls.Settings(**world))


@cache
def scene_of(config: str, seed: int) -> Scene:
    return build(config).draw(seed)


@pytest.mark.parametrize("config", CONFIGS)
def test_a_seed_draws_one_scene_and_other_seeds_others(config: str) -> None:
    scenes = [scene_of(config, seed) for seed in SEEDS]
    assert all(same(scene, build(config).draw(seed)) for seed, scene in enumerate(scenes))
    differ = [not same(a, b) for k, a in enumerate(scenes) for b in scenes[:k]]
    if config in UNSEEDED:
        assert not any(differ)
    elif config.startswith("passage"):
        assert any(differ)  # only the side is drawn
        assert not all(differ)
    else:
        assert all(differ)


@pytest.mark.parametrize("config", CONFIGS)
def test_names_are_unique(config: str) -> None:
    scene = scene_of(config, 0)
    names = [part.name for part in (*scene.static, *scene.movers)]
    assert len(set(names)) == len(names)
    if config in WALKED:
        assert [m.name for m in scene.movers] == [f"walker_{k}" for k in range(len(scene.movers))]


@pytest.mark.parametrize("config", CONFIGS)
def test_start_and_goal_are_free(config: str) -> None:
    for seed in SEEDS:
        scene = scene_of(config, seed)
        assert np.all(clearance(scene, ends(scene)) >= ROBOT_M + 0.1)


@pytest.mark.parametrize("config", CONFIGS)
def test_movers_keep_out_of_what_stands(config: str) -> None:
    for seed in SEEDS:
        scene = scene_of(config, seed)
        for mover in scene.movers:
            poses = [mover.pose_at(t) for t in np.arange(0.0, scene.time_limit_s, 0.1)]
            edge = np.array([pose.apply(outline(mover.shape)) for pose in poses])
            assert clearance(scene, edge).min() > 0.0


@pytest.mark.parametrize("config", WALKED)
def test_walkers_begin_and_rest_out_of_the_way(config: str) -> None:
    for seed in SEEDS:
        scene = scene_of(config, seed)
        start, goal = ends(scene)
        for mover in scene.movers:
            first, last = mover.pose_at(0.0), mover.pose_at(scene.time_limit_s)
            assert np.hypot(first.x - start[0], first.y - start[1]) > SENSING_M
            if config == "dynamic_hallway_random":
                assert mover.keyframes[-1, 0] >= scene.time_limit_s  # they never rest
            else:
                assert np.hypot(last.x - start[0], last.y - start[1]) > SENSING_M
                assert np.hypot(last.x - goal[0], last.y - goal[1]) > SENSING_M


@pytest.mark.parametrize("config", WALKED)
def test_walkers_keep_a_constant_speed_within_the_settings(config: str) -> None:
    settings = build(config)._settings
    for seed in SEEDS:
        for mover in scene_of(config, seed).movers:
            steps = np.diff(mover.keyframes, axis=0)
            assert np.all(steps[:, 0] > 0.0)
            speeds = np.hypot(steps[:, 1], steps[:, 2]) / steps[:, 0]
            np.testing.assert_allclose(speeds, speeds[0], rtol=1e-9)
            assert settings.min_speed_m_s - 1e-9 <= speeds[0] <= settings.max_speed_m_s + 1e-9


@pytest.mark.parametrize("config", ["corridor_crossing", "dynamic_hallway_four"])
def test_walkers_do_not_walk_through_one_another(config: str) -> None:
    for seed in SEEDS:
        movers = scene_of(config, seed).movers
        for t in np.arange(0.0, 60.0, 0.1):
            poses = [m.pose_at(t) for m in movers]
            apart = min(a.distance(b) for k, a in enumerate(poses) for b in poses[:k])
            assert apart > 2.0 * movers[0].shape.half_extents_m[0]


@pytest.mark.parametrize(
    ("config", "radius_m"),
    [(config, ROBOT_M) for config in CONFIGS]
    + [(config, JACKAL_M) for config in ("static_corridor", "dynamic_hallway", "cluttered", "corridor_crossing", "door")],
)
def test_a_disc_fits_through_from_start_to_goal(config: str, radius_m: float) -> None:
    for seed in SEEDS[:3]:
        scene = scene_of(config, seed)
        points = lattice(scene, 0.05)
        _, labels = cv2.connectedComponents((clearance(scene, points) > radius_m).astype(np.uint8), connectivity=4)
        start, goal = (labels[cell_of(points, *end)] for end in ends(scene))
        assert start == goal != 0


@pytest.mark.parametrize("config", [config for config in CONFIGS if config != "fov_limited"])
def test_who_knew_all_in_advance_reaches_the_goal_untouched(config: str) -> None:
    # The set of places that a 0.5 m/s disc with 0.1 m to spare can have reached by now, grown step by step.
    cell_m, step_s, speed_m_s, keep_m = 0.1, 0.2, 0.5, ROBOT_M + 0.1
    reach = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    assert speed_m_s * step_s <= cell_m * 1.0001
    for seed in SEEDS:
        scene = scene_of(config, seed)
        points = lattice(scene, cell_m)
        free = clearance(scene, points) > keep_m
        reached = np.zeros(free.shape, dtype=np.uint8)
        start, goal = (cell_of(points, *end) for end in ends(scene))
        reached[start], time_s = 1, 0.0
        while not reached[goal] and time_s < scene.time_limit_s:
            time_s += step_s
            reached = cv2.dilate(reached, reach) & free
            for mover in scene.movers:
                reached[gap(mover.shape, mover.pose_at(time_s), points) < keep_m] = 0
        assert reached[goal], f"seed {seed}"
        assert time_s < 0.95 * scene.time_limit_s


def test_the_blind_corner_meets_who_drives_on() -> None:
    for seed in SEEDS:
        (mover,) = scene_of("fov_limited", seed).movers
        times = np.arange(0.0, 6.0, 0.02)
        for speed in (0.35, 0.4, 0.45, 0.5):
            poses = [mover.pose_at(t) for t in times]
            driven = [0.5 + max(0.0, speed * (t - 0.25 - 0.5 * speed / 0.8)) for t in times]  # 0.25 s to start, 0.8 m/s^2
            touching = [np.hypot(pose.x - x, pose.y) < ROBOT_M + 0.25 for pose, x in zip(poses, driven, strict=True)]
            assert any(touching)
            seen = [abs(np.arctan2(pose.y, pose.x - x)) < np.deg2rad(43.5) for pose, x in zip(poses, driven, strict=True)]
            assert np.sum(seen[: touching.index(True)]) * 0.02 < 0.4  # the D455 looks 43.5 degrees to either side


def test_a_door_opens_and_closes_in_turn() -> None:
    for config in ("door", "door_swinging"):
        scene, settings = scene_of(config, 4), build(config)._settings
        (leaf,) = scene.movers
        doorway = np.column_stack((np.full(19, settings.door_x_m), np.linspace(-0.45, 0.45, 19)))

        def blocked(t: float, leaf=leaf, doorway=doorway) -> np.ndarray:
            return gap(leaf.shape, leaf.pose_at(t), doorway) < 0.1

        states = np.array([blocked(t).mean() for t in np.arange(0.0, settings.leaf.period_s, 0.05)])
        for state, rest_s in ((0.0, settings.open_s), (1.0, settings.closed_s)):
            lasts_s = np.mean(states == state) * settings.leaf.period_s
            assert rest_s - 0.1 <= lasts_s < rest_s + settings.move_s
        assert np.array_equal(blocked(3.0), blocked(3.0 + settings.leaf.period_s))


def test_the_worse_channel_is_the_one_asked_for() -> None:
    for side, sign in (("left", 1.0), ("right", -1.0)):
        scene = PassageSelection(PassageSelection.Settings(worse_side=side, worse_channel="blocked")).draw(0)
        worse, better = clearance(scene, np.array([[7.0, sign * 0.7], [7.0, -sign * 0.7]]))
        assert worse < 0.0 < better
    both = PassageSelection(PassageSelection.Settings(worse_channel="open")).draw(0)
    assert np.all(clearance(both, np.array([[7.0, 0.7], [7.0, -0.7]])) > 0.6)


def test_bouncing_reflects_at_walls_and_in_a_corner() -> None:
    room = np.array([[0.0, 0.0], [2.0, 1.0]])
    way = bounce(np.array([0.5, 0.5]), 0.0, 0.5, room, 10.0)
    np.testing.assert_allclose(way[:4], [[0.0, 0.5, 0.5], [3.0, 2.0, 0.5], [7.0, 0.0, 0.5], [11.0, 2.0, 0.5]])
    corner = bounce(np.array([1.0, 0.0]), np.pi / 4, np.sqrt(2.0), room, 1.5)
    np.testing.assert_allclose(corner[1:], [[1.0, 2.0, 1.0], [2.0, 1.0, 0.0]], atol=1e-9)


@pytest.mark.parametrize("config", CONFIGS)
def test_the_world_compiles_and_steps(config: str) -> None:
    scene = scene_of(config, 1)
    world = MujocoWorld(scene, WorldSettings())
    world.compile()
    world.step_to(1_000_000_000)
    assert world.now_ns == 1_000_000_000
    assert world.data.ncon == 0
    for mover in scene.movers:
        pose, body = mover.pose_at(1.0), world.data.body(mover.name)
        np.testing.assert_allclose(body.xpos, [pose.x, pose.y, mover.shape.half_extents_m[2]], atol=1e-12)
        np.testing.assert_allclose(body.xmat[[0, 3]], [np.cos(pose.yaw), np.sin(pose.yaw)], atol=1e-12)


@pytest.mark.parametrize(
    ("cls", "settings", "said"),
    [
        (StaticCorridor, {"length_m": 1.0}, "length_m"),
        (StaticCorridor, {"length_m": float("nan")}, "length_m"),
        (StaticCorridor, {"walkers": 1}, "walkers"),
        (DynamicHallway, {"walkers": 0}, "walkers"),
        (DynamicHallway, {"directions": "sideways"}, "directions"),
        (DynamicHallway, {"min_speed_m_s": 1.5}, "max_speed_m_s"),
        (DynamicHallway, {"lateral_m": 1.1}, "half_width_m"),
        (LongCorridor, {"max_speed_m_s": -1.0}, "max_speed_m_s"),
        (CorridorCrossing, {"crossing_angle_deg": 90.0}, "crossing_angle_deg"),
        (Cluttered, {"half_width_m": 1.0}, "half_width_m"),
        (OccludedBoundary, {"occluder_depth_m": 2.0}, "occluder_depth_m"),
        (FovLimited, {"passage_width_m": 0.5}, "passage_width_m"),
        (PassageSelection, {"narrow_width_m": 2.0}, "narrow_width_m"),
        (PassageSelection, {"split_length_m": 20.0}, "centre wall"),
        (Door, {"opening_m": 1.4}, "half_width_m"),
        (Door, {"door_x_m": 10.5}, "door_x_m"),
        (Door, {"closed_s": 0.0}, "closed_s"),
    ],
)
def test_nonsense_is_refused(cls: type[Scenario], settings: dict, said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        cls.Settings(**settings)
