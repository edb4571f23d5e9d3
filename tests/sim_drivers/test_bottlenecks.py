"""What closes after a robot has entered: the traps of the risk-sensitive planner, proven passable and proven traps."""

from functools import cache

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from runtime.registry import Part, load
from sim_drivers.scenarios.dynamic_bottleneck import DynamicBottleneck
from sim_drivers.scenarios.near_miss import NearMiss
from sim_drivers.scenarios.warehouse_squeeze import WarehouseSqueeze
from sim_drivers.scene import Scene
from tests.sim_drivers.footprints import cell_of, clearance, ends, gap, lattice, outline, same

SCENARIOS = ("dynamic_bottleneck", "warehouse_squeeze", "near_miss")
SEEDS = range(30)  # those of the evaluation
RADIUS_M = 0.333  # of the Jackal
CELL_M = 0.1


@cache
def scene_of(name: str, seed: int) -> Scene:
    cls = load(Part.SCENARIO, name)
    return cls(cls.Settings()).draw(seed)


def way_through(scene: Scene) -> np.ndarray:
    """Shortest way on the free cells, from start to goal, as points (n, 2): breadth-first from the goal, then downhill."""
    points = lattice(scene, CELL_M)
    free = (clearance(scene, points) > RADIUS_M + 0.05).astype(np.uint8)
    start, goal = (cell_of(points, *end) for end in ends(scene))
    steps, reached = np.full(free.shape, np.inf), np.zeros_like(free)
    reached[goal], steps[goal], count = 1, 0, 0
    ball = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    while not reached[start]:
        count += 1
        grown = cv2.dilate(reached, ball) & free
        steps[(grown == 1) & (reached == 0)] = count
        reached = grown
    cells = [start]
    while cells[-1] != goal:
        r, c = cells[-1]
        near = [(r + i, c + j) for i, j in ((0, 1), (1, 0), (-1, 0), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))]
        cells.append(min(near, key=lambda cell: steps[cell]))
    return np.array([points[cell] for cell in cells])


def driven_blindly(scene: Scene, speed_m_s: float) -> tuple[float, float]:
    """Drive the static way at a speed, whatever comes: least gap to a mover, and that gap one second before [m]."""
    way = way_through(scene)
    along = np.concatenate((np.zeros(1), np.cumsum(np.hypot(*np.diff(way, axis=0).T))))
    times = np.arange(0.0, along[-1] / speed_m_s, 0.1)
    places = np.column_stack([np.interp(speed_m_s * times, along, way[:, axis]) for axis in (0, 1)])
    gaps = np.array([[gap(m.shape, m.pose_at(t), p) for m in scene.movers] for t, p in zip(times, places, strict=True)])
    least = gaps.min(axis=1) - RADIUS_M
    if not (least < 0.0).any():
        return float(least.min()), np.inf
    first = int(np.argmax(least < 0.0))
    return float(least.min()), float(least[max(0, first - 10)])


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_seed_draws_one_scene_and_other_seeds_others(name: str) -> None:
    cls = load(Part.SCENARIO, name)
    assert all(same(scene_of(name, seed), cls(cls.Settings()).draw(seed)) for seed in SEEDS)
    assert not any(same(scene_of(name, a), scene_of(name, b)) for a in SEEDS for b in range(a))


@pytest.mark.parametrize("name", SCENARIOS)
def test_what_moves_keeps_out_of_what_stands_and_to_the_drawn_speeds(name: str) -> None:
    for seed in SEEDS:
        scene, settings = scene_of(name, seed), load(Part.SCENARIO, name).Settings()
        for mover in scene.movers:
            poses = [mover.pose_at(t) for t in np.arange(0.0, scene.time_limit_s, 0.5)]
            edge = np.array([pose.apply(outline(mover.shape)) for pose in poses])
            assert clearance(scene, edge).min() > 0.0
            steps = np.diff(mover.keyframes, axis=0)
            speeds = np.hypot(steps[:, 1], steps[:, 2]) / steps[:, 0]
            walks = speeds > 0.0
            assert settings.min_speed_m_s - 1e-9 <= speeds[walks].min()
            assert speeds[walks].max() <= settings.max_speed_m_s + 1e-9
            assert np.ptp(speeds[walks]) < 1e-9
            np.testing.assert_allclose(mover.keyframes[0, 1:], mover.keyframes[-1, 1:], atol=1e-12)  # it never jumps


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_seed_can_be_passed_with_room_to_spare(name: str) -> None:
    # The places that a disc of 0.5 m/s with 3 cm to spare can have reached by now, grown step by step.
    speed_m_s, keep_m = 0.5, RADIUS_M + 0.03
    ball = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    for seed in SEEDS:
        scene = scene_of(name, seed)
        points = lattice(scene, CELL_M)
        free = clearance(scene, points) > keep_m
        reached = np.zeros(free.shape, dtype=np.uint8)
        start, goal = (cell_of(points, *end) for end in ends(scene))
        reached[start], time_s = 1, 0.0
        while not reached[goal] and time_s < scene.time_limit_s:
            time_s += CELL_M / speed_m_s
            reached = cv2.dilate(reached, ball) & free
            for mover in scene.movers:
                reached[gap(mover.shape, mover.pose_at(time_s), points) < keep_m] = 0
        assert reached[goal], f"seed {seed}"
        assert time_s < 0.6 * scene.time_limit_s


@pytest.mark.parametrize("name", SCENARIOS)
def test_who_drives_on_is_caught_by_what_was_far_when_he_entered(name: str) -> None:
    driven = np.array([driven_blindly(scene_of(name, seed), speed) for seed in SEEDS for speed in (0.5, 0.7)])
    caught = driven[:, 0] < 0.0
    assert caught.mean() > 0.4
    assert np.median(driven[caught, 1]) > 0.5  # a second before, there was room


def test_posts_let_sight_through_but_no_robot() -> None:
    for seed in SEEDS:
        posts = [o for o in scene_of("dynamic_bottleneck", seed).static if o.name.startswith("post")]
        for row in range(3):
            places = np.sort([o.map_from_shape.y for o in posts if o.name.startswith(f"post_{row}")])
            gaps = np.diff(places) - 2.0 * posts[0].shape.half_extents_m[0]
            assert gaps.max() == pytest.approx(1.3)
            assert np.sum(gaps > 2.0 * RADIUS_M) == 1
            assert 0.15 < gaps.min() < 2.0 * RADIUS_M


@pytest.mark.parametrize(
    ("cls", "settings", "said"),
    [
        (DynamicBottleneck, {"opening_m": 0.5}, "opening_m"),
        (DynamicBottleneck, {"min_speed_m_s": 1.5}, "max_speed_m_s"),
        (WarehouseSqueeze, {"min_rest_s": 9.0}, "max_rest_s"),
        (WarehouseSqueeze, {"aisle_half_width_m": 0.3}, "aisle_half_width_m"),
        (NearMiss, {"slant_m": 2.0}, "slant_m"),
        (NearMiss, {"hesitate_probability": 1.5}, "hesitate_probability"),
    ],
)
def test_nonsense_is_refused(cls: type, settings: dict, said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        cls.Settings(**settings)
