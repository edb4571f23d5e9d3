"""The marker camera: what the real detector makes of the pictures, against where the plates really are."""

import math

import numpy as np
import pytest

from drivers.interface.devices import DeviceSetup
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2, SE3
from drivers.interface.samples import MarkerSample
from estimators.tracks.marker_pose import marker_pose
from sim_drivers.marker_camera import MarkerCameraSettings, SimMarkerCamera
from sim_drivers.scene import MarkerPlate, Mover, Scene, Shape, StaticObstacle
from sim_drivers.world import MujocoWorld, WorldSettings

FRONT = SE3.from_euler(-0.15, 0.0, 0.0, math.pi / 2, 0.0, -math.pi / 2)  # on the side that faces -x, upright
SIDE_M = 0.12


def scene(distance_m: float, *, yaw: float = 0.0, plates: tuple[MarkerPlate, ...] = (), movers: tuple[Mover, ...] = ()) -> Scene:
    box = StaticObstacle("box", Shape.box(0.3, 0.3, 0.8), SE2(distance_m, 0.1, yaw))
    return Scene("markers", SE2(), (), 10.0, (box,), movers, markers=plates or (MarkerPlate("box", FRONT, SIDE_M, 11),))


def look(scene: Scene, seconds: float = 0.0, **settings: object) -> tuple[MujocoWorld, MarkerSample]:
    """Return what is seen at the end of some time, without delay or loss."""
    world = MujocoWorld(scene, WorldSettings())
    keys = {"latency_s": 0.0, "loss_probability": 0.0, "rate_hz": 10.0} | settings
    camera = SimMarkerCamera(MarkerCameraSettings(**keys), DeviceSetup("markers", 5, lambda: world.now_ns, world))
    world.compile()
    camera.open()
    world.step_to(round((seconds + 0.1) * 1e9))
    return world, camera.drain()[-1]


@pytest.mark.parametrize(("distance_m", "yaw"), [(0.8, 0.0), (1.2, 0.5), (1.6, -0.6)])
def test_the_pose_is_right_to_millimetres_and_degrees(distance_m: float, yaw: float) -> None:
    _, sample = look(scene(distance_m, yaw=yaw))
    assert sample.ids == (11,)
    pose = marker_pose(sample.corners_px[0], SIDE_M, sample.intrinsics, 0.3)
    assert pose is not None
    truth = sample.base_from_optical.inverse() @ SE3.from_euler(distance_m, 0.1, 0.4, 0.0, 0.0, yaw) @ FRONT
    off = pose.position_m - truth.translation
    assert np.abs(off[:2]).max() < 0.003
    assert abs(off[2]) < 0.015 * distance_m  # a pixel of 434 px over a side of 12 cm
    cosine = 0.5 * (np.trace(pose.rotation.T @ truth.rotation) - 1.0)
    assert math.degrees(math.acos(min(cosine, 1.0))) < 4.0


def test_a_marker_of_another_dictionary_is_not_seen() -> None:
    mine, other = MarkerPlate("box", FRONT, SIDE_M, 3, "4X4_50"), MarkerPlate("box", FRONT, SIDE_M, 3, "5X5_50")
    assert look(scene(1.0, plates=(mine,)))[1].ids == (3,)
    assert look(scene(1.0, plates=(other,)))[1].ids == ()
    assert look(scene(1.0, plates=(other,)), dictionary="5X5_50")[1].ids == (3,)


def test_what_walks_before_it_hides_it() -> None:
    keyframes = np.array([[0.0, 0.6, -1.0, 0.0], [2.0, 0.6, 1.0, 0.0]])
    walker = Mover("walker", Shape.cylinder(0.15, 1.7), keyframes)
    hidden = scene(1.2, movers=(walker,))
    assert [look(hidden, seconds)[1].ids for seconds in (0.2, 1.0, 1.7)] == [(11,), (), (11,)]


def test_its_back_and_what_is_behind_the_camera_are_not_seen() -> None:
    assert look(scene(1.0, yaw=math.pi))[1].ids == ()
    assert look(scene(-1.0))[1].ids == ()


def test_several_are_told_apart_and_ordered() -> None:
    left, right = (
        MarkerPlate("box", SE3.from_euler(-0.15, y, 0.0, math.pi / 2, 0.0, -math.pi / 2), 0.08, number)
        for y, number in ((0.07, 21), (-0.07, 4))
    )
    _, sample = look(scene(0.9, plates=(left, right)))
    assert sample.ids == (4, 21)
    assert sample.corners_px[0, :, 0].mean() > sample.corners_px[1, :, 0].mean()  # what is right in base is right in the image


def test_blur_and_noise_end_its_sight() -> None:
    assert look(scene(1.5), blur_px=6.0)[1].ids == ()


def test_a_plate_needs_a_carrier() -> None:
    with pytest.raises(ConfigurationError, match="'table', which the scene lacks"):
        look(scene(1.0, plates=(MarkerPlate("table", FRONT, SIDE_M, 1),)))
