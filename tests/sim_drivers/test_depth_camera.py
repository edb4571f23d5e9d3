"""The simulated D455: geometry of its picture, error model, holes, latency, life."""

import numpy as np
import pytest
from pydantic import ValidationError

from drivers.interface.devices import DeviceSetup
from drivers.interface.geometry import SE2
from drivers.interface.seeds import stream
from sim_drivers.depth_camera import D455, DepthCameraSettings, SimDepthCamera, intrinsics
from sim_drivers.depth_noise import DepthNoiseSettings, spoil
from sim_drivers.scene import Mover, Scene, Shape, StaticObstacle
from sim_drivers.world import MujocoWorld, WorldSettings

PERFECT = {
    "loss_probability": 0.0,
    "noise": {"subpixel_px": 0, "shadow_hole_probability": 0, "edge_hole_probability": 0, "dropout_probability": 0},
}
WALL = StaticObstacle("wall", Shape.box(0.2, 20.0, 6.0), SE2(3.1, 0.0, 0.0))


def looking_at(*static, seed=1, start=None, movers=(), **settings):
    """A camera in base's origin that looks along x, in an opened world."""
    world = MujocoWorld(Scene("test", start or SE2(), (), 60.0, tuple(static), movers), WorldSettings(physics_step_s=0.002))
    setup = DeviceSetup("camera", seed, lambda: world.now_ns, world)
    camera = SimDepthCamera(DepthCameraSettings(**{"x_m": 0.0, **settings}), setup)
    world.compile()
    camera.open()
    return world, camera


def frame_after(world, camera, seconds=0.2):
    world.step_to(world.now_ns + round(seconds * 1e9))
    frame = camera.latest()
    assert frame is not None
    return frame


def points_in_base(frame):
    """Deproject every known pixel, shape (n, 3), as the RealSense does."""
    v, u = np.nonzero(frame.depth)
    z = frame.depth[v, u] * frame.depth_unit_m
    k = frame.intrinsics
    return frame.base_from_optical.apply(np.stack(((u - k.cx) / k.fx * z, (v - k.cy) / k.fy * z, z), axis=-1))


def test_a_wall_and_the_floor_deproject_to_where_they_are():
    world, camera = looking_at(WALL, **PERFECT, x_m=0.2, y_m=-0.1, z_m=0.5, pitch_rad=0.3, yaw_rad=0.2, roll_rad=0.1)
    points = points_in_base(frame_after(world, camera))
    on_floor, on_wall = np.abs(points[:, 2]) < 0.002, np.abs(points[:, 0] - 3.0) < 0.002
    assert (on_floor | on_wall).all()
    assert on_floor.sum() > 1000
    assert on_wall.sum() > 1000


def test_the_picture_moves_with_the_robot():
    world, camera = looking_at(WALL, **PERFECT, start=SE2(1.0, 2.0, 0.3))
    frame = frame_after(world, camera)
    in_map = SE2(1.0, 2.0, 0.3).apply(points_in_base(frame)[:, :2])
    assert in_map[:, 0].max() == pytest.approx(3.0, abs=0.002)


def test_a_decimated_picture_shows_the_same_as_the_full_one():
    full, small = intrinsics(848, 480), intrinsics(160, 90)
    assert full == D455
    for edge_u in (0, 848):  # the left and right borders of the image lie in the same directions
        of_full = (edge_u - 0.5 - full.cx) / full.fx
        of_small = (edge_u * 160 / 848 - 0.5 - small.cx) / small.fx
        assert of_small == pytest.approx(of_full, abs=1e-12)


def test_another_field_of_view_reaches_its_angle():
    k = intrinsics(161, 90, 120.0)
    half = np.arctan((80.5) / k.fx)
    assert np.degrees(2 * half) == pytest.approx(120.0)


def test_error_grows_with_the_square_of_range_as_the_stereo_formula_says():
    settings = DepthNoiseSettings(shadow_hole_probability=0.0, edge_hole_probability=0.0, dropout_probability=0.0)
    for z in (1.0, 2.0, 4.0):
        true = np.full((120, 160), z, np.float32)
        depth = spoil(true, stream(3, "noise"), settings, 82.0, 434.27, (0.1, 20.0, 1e-4)) * 1e-4
        expected = z**2 * 0.08 / (434.27 * 0.095)
        assert depth.std() == pytest.approx(expected, rel=0.03)
        assert depth.mean() == pytest.approx(z, abs=4 * expected / np.sqrt(true.size))
    assert expected < 0.02 * 4.0  # the data sheet's bound at 4 m


def test_the_stereo_shadow_lies_left_of_what_is_in_front_and_is_as_wide_as_the_disparities_say():
    settings = DepthNoiseSettings(
        subpixel_px=0.0, shadow_hole_probability=1.0, edge_hole_probability=0.0, dropout_probability=0.0
    )
    focal_px, near, far = 434.27, 1.0, 4.0
    true = np.full((4, 800), far, np.float32)
    true[:, 400:500] = near
    depth = spoil(true, stream(0, "noise"), settings, focal_px, focal_px, (0.1, 20.0, 0.001))
    holes = np.flatnonzero(depth[0] == 0)
    band = focal_px * 0.095 / far  # the right imager does not see the first columns
    shadow = focal_px * 0.095 * (1 / near - 1 / far)
    expected = [*range(int(np.ceil(band))), *range(400 - int(shadow), 400)]
    assert holes.tolist() == expected
    assert (depth[0, 400:500] == 1000).all()


def test_a_slanted_floor_has_no_edges():
    settings = {**PERFECT, "noise": {**PERFECT["noise"], "edge_hole_probability": 1.0}, "min_range_m": 0.0}
    world, camera = looking_at(**settings)
    depth = frame_after(world, camera).depth
    below = (0.4 * camera._intrinsics.fy / 6.0) + camera._intrinsics.cy  # the horizon at 6 m
    assert (depth[int(below) + 2 :] > 0).all()


def test_too_near_and_too_far_is_not_known():
    near = StaticObstacle("near", Shape.box(0.02, 0.2, 2.0), SE2(0.35, 0.0, 0.0))
    world, camera = looking_at(near, WALL, **PERFECT, range_max_m=2.9)
    depth = frame_after(world, camera).depth
    assert depth[45, 80] == 0  # the near one, at 0.34 m
    assert depth[20, 120] == 0  # the wall, at 3 m
    assert depth[depth > 0].min() >= 400
    assert depth.max() <= 2900


def test_holes_come_as_often_as_the_settings_say():
    world, camera = looking_at(WALL, noise={"dropout_probability": 0.1, "shadow_hole_probability": 0, "edge_hole_probability": 0})
    depth = frame_after(world, camera).depth[:40]  # above the floor
    assert (depth == 0).mean() == pytest.approx(0.1, abs=0.015)


def test_frames_come_late_and_only_the_newest_counts():
    world, camera = looking_at(WALL, rate_hz=20.0, latency_s=0.03, loss_probability=0.0)
    world.step_to(79_000_000)
    assert camera.latest() is None  # captured at 50 ms, on its way until 80 ms
    world.step_to(80_000_000)
    frame = camera.latest()
    assert (frame.stamp.captured_ns, frame.stamp.received_ns) == (50_000_000, 80_000_000)
    assert camera.latest() is None
    world.step_to(280_000_000)
    assert camera.latest().stamp.captured_ns == 250_000_000
    health = camera.health()
    assert (health.received, health.overflowed, health.dropped) == (5, 3, 0)
    assert health.expected_period_ns == 50_000_000


def test_lost_frames_are_counted_and_leave_a_gap():
    world, camera = looking_at(WALL, rate_hz=50.0, latency_s=0.0, loss_probability=0.3)
    seen = []
    for tick in range(1, 51):
        world.step_to(tick * 20_000_000)
        frame = camera.latest()
        seen += [] if frame is None else [frame.stamp.sequence]
    assert 5 <= camera.health().dropped <= 25
    assert len(seen) + camera.health().dropped == 50
    assert sorted(set(seen)) == seen


def test_a_moving_walker_is_seen_where_it_was_at_capture():
    walker = Mover("walker", Shape.cylinder(0.25, 1.7), np.array([[0.0, 3.0, 0.0, 0.0], [2.0, 1.0, 0.0, 0.0]]))
    world, camera = looking_at(movers=(walker,), **PERFECT)
    for _ in range(3):
        frame = frame_after(world, camera)
        nearest = frame.depth[:45, 70:90][frame.depth[:45, 70:90] > 0].min() * 0.001
        expected = walker.pose_at(frame.stamp.captured_ns * 1e-9).x - 0.25
        assert nearest == pytest.approx(expected, abs=0.002)


def test_same_seed_same_frames_and_another_seed_others():
    def frames(seed):
        world, camera = looking_at(WALL, seed=seed)
        return [frame_after(world, camera).depth for _ in range(3)]

    first, again, other = frames(1), frames(1), frames(2)
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[0], other[0])
    assert not np.array_equal(first[0], first[1])


def test_a_frame_cannot_be_changed():
    world, camera = looking_at(WALL)
    with pytest.raises(ValueError, match="read-only"):
        frame_after(world, camera).depth[0, 0] = 1


@pytest.mark.parametrize("wrong", [{"min_range_m": 2.0, "range_max_m": 1.0}, {"range_max_m": 20.0, "depth_unit_m": 0.0001}])
def test_settings_that_contradict_each_other_are_refused(wrong):
    with pytest.raises(ValidationError, match="range_max_m"):
        DepthCameraSettings(**wrong)
