"""The ray caster against MuJoCo's own rays, which test every ray against every geom."""

import mujoco
import numpy as np
import pytest

from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import BODY_FROM_OPTICAL, SE3
from drivers.interface.samples import Intrinsics
from sim_drivers.ray_caster import RayCaster

GEOM = mujoco.mjtGeom
INTRINSICS = Intrinsics(width=81, height=61, fx=45.0, fy=43.0, cx=41.3, cy=29.2)
KINDS = (GEOM.mjGEOM_BOX, GEOM.mjGEOM_CYLINDER, GEOM.mjGEOM_SPHERE, GEOM.mjGEOM_CAPSULE, GEOM.mjGEOM_ELLIPSOID)


def compiled(spec):
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def floor(spec, half_lengths=(0, 0)):
    spec.worldbody.add_geom(type=GEOM.mjGEOM_PLANE, size=[*half_lengths, 1])


def random_solids(seed, count, spread_m, kinds=KINDS):
    """Tumbled solids around the origin: ahead of, behind and beside a camera there, and across its image plane."""
    rng = np.random.default_rng(seed)
    spec = mujoco.MjSpec()
    floor(spec)
    for _ in range(count):
        spec.worldbody.add_geom(
            type=kinds[rng.integers(len(kinds))],
            size=rng.uniform(0.05, 0.4, 3),
            pos=np.array((0, 0, 1)) + rng.uniform(-spread_m, spread_m, 3),
            quat=rng.normal(size=4),
        )
    return compiled(spec)


def camera(seed):
    rng = np.random.default_rng(seed)
    roll, pitch, yaw = rng.uniform(-0.6, 0.6), rng.uniform(-0.8, 0.8), rng.uniform(-3.1, 3.1)
    x, y, z = rng.uniform(-0.5, 0.5, 3)
    return SE3.from_euler(x, y, z + 1.0, roll, pitch, yaw) @ BODY_FROM_OPTICAL


def mujoco_ranges(model, data, origin, directions, groups=None):
    ranges, geoms = np.empty(len(directions)), np.empty(len(directions), np.int32)
    flat = np.ascontiguousarray(directions).ravel()
    mujoco.mj_multiRay(model, data, origin, flat, groups, 1, -1, geoms, ranges, None, len(directions), 1e10)
    return np.where(ranges < 0, np.inf, ranges)


def mujoco_depth(model, data, pose, intrinsics=INTRINSICS, groups=None):
    """Depth along the optical axis, by MuJoCo's rays."""
    k = intrinsics
    v, u = np.mgrid[: k.height, : k.width]
    rays = np.stack(((u - k.cx) / k.fx, (v - k.cy) / k.fy, np.ones(u.shape)), axis=-1).reshape(-1, 3)
    length = np.linalg.norm(rays, axis=1)
    directions = (rays / length[:, None]) @ pose.rotation.T
    return (mujoco_ranges(model, data, pose.translation, directions, groups) / length).reshape(k.height, k.width)


def cast(model, data, pose, intrinsics=INTRINSICS, far_m=np.inf, without_subtree=None):
    caster = RayCaster(model, without_subtree)
    return caster.depth_image(data, pose.translation, pose.rotation, intrinsics, far_m)


def assert_same(depth, reference):
    assert depth.dtype == np.float32
    np.testing.assert_allclose(depth, reference, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_agrees_with_mujoco_among_tumbled_solids(seed):
    model, data = random_solids(seed, count=40, spread_m=3.0)
    pose = camera(seed)
    assert_same(cast(model, data, pose), mujoco_depth(model, data, pose))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_agrees_with_mujoco_close_up(kind, seed):
    """So close that most solids cross the image plane, and some hold the camera inside."""
    model, data = random_solids(seed, count=15, spread_m=0.5, kinds=(kind,))
    pose = camera(seed)
    reference = mujoco_depth(model, data, pose)
    seen = reference > 1e-3  # what touches the lens is cut off
    assert seen.mean() > 0.9
    assert_same(cast(model, data, pose)[seen], reference[seen])


def test_agrees_with_mujoco_in_a_forest_of_cylinders():
    rng = np.random.default_rng(5)
    spec = mujoco.MjSpec()
    floor(spec)
    for _ in range(350):
        x, y = rng.uniform(-6, 6, 2)
        spec.worldbody.add_geom(type=GEOM.mjGEOM_CYLINDER, size=[0.075, 0.5, 0], pos=[x, y, 0.5])
    model, data = compiled(spec)
    pose = SE3.from_euler(0.0, 0.0, 0.4, 0.0, 0.0, 0.3) @ BODY_FROM_OPTICAL
    assert_same(cast(model, data, pose), mujoco_depth(model, data, pose))


def test_agrees_with_mujoco_between_long_walls():
    """Walls that begin behind the camera and run on beside it; a level camera on the axis, so many rays run parallel."""
    spec = mujoco.MjSpec()
    floor(spec, half_lengths=(3, 2))
    for side in (-1, 1):
        spec.worldbody.add_geom(type=GEOM.mjGEOM_BOX, size=[10, 0.05, 0.5], pos=[5, side, 0.5])
    model, data = compiled(spec)
    level = Intrinsics(width=81, height=61, fx=45.0, fy=45.0, cx=40.0, cy=30.0)
    pose = SE3.from_euler(0.0, 0.0, 0.3, 0.0, 0.0, 0.0) @ BODY_FROM_OPTICAL
    depth = cast(model, data, pose, level)
    assert_same(depth, mujoco_depth(model, data, pose, level))
    assert depth[60, 40] == pytest.approx(0.3 * 45.0 / 30.0)  # the floor, 0.3 m below, 30 pixels under the axis
    assert depth[30, 80] == pytest.approx(0.95 * 45.0 / 40.0)  # the right wall's face


def test_depth_is_along_the_optical_axis_and_beyond_far_is_nothing():
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(type=GEOM.mjGEOM_BOX, size=[0.1, 10, 10], pos=[2.1, 0, 0])
    model, data = compiled(spec)
    np.testing.assert_allclose(cast(model, data, BODY_FROM_OPTICAL), 2.0, rtol=1e-6)  # a wall has one depth, not one range
    assert np.isinf(cast(model, data, BODY_FROM_OPTICAL, far_m=1.9)).all()


def test_the_robot_does_not_see_itself():
    model, data = compiled(robot_before_wall())
    assert cast(model, data, BODY_FROM_OPTICAL)[29, 41] == pytest.approx(0.4, abs=1e-3)
    depth = cast(model, data, BODY_FROM_OPTICAL, without_subtree="base")
    others = np.array([1, 0, 0, 0, 0, 0], np.uint8)
    assert_same(depth, mujoco_depth(model, data, BODY_FROM_OPTICAL, groups=others))


def robot_before_wall():
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(type=GEOM.mjGEOM_BOX, size=[0.1, 1, 1], pos=[2.1, 0, 0])
    base = spec.worldbody.add_body(name="base")
    base.add_geom(type=GEOM.mjGEOM_SPHERE, size=[0.1, 0, 0], pos=[0.8, 0, 0], group=1)
    arm = base.add_body(name="arm", pos=[0.5, 0, 0])
    arm.add_geom(type=GEOM.mjGEOM_SPHERE, size=[0.1, 0, 0], group=1)
    return spec


def test_transparent_geoms_are_not_seen():
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(type=GEOM.mjGEOM_SPHERE, size=[0.2, 0, 0], pos=[1, 0, 0], rgba=[1, 1, 1, 0])
    model, data = compiled(spec)
    assert np.isinf(cast(model, data, BODY_FROM_OPTICAL)).all()


def test_a_moved_geom_is_seen_where_it_is_now():
    spec = mujoco.MjSpec()
    body = spec.worldbody.add_body(name="walker", mocap=True, pos=[1, 0, 0])
    body.add_geom(type=GEOM.mjGEOM_SPHERE, size=[0.2, 0, 0])
    model, data = compiled(spec)
    caster = RayCaster(model)
    for x in (1.0, 2.5):
        data.mocap_pos[0] = x, 0, 0
        mujoco.mj_kinematics(model, data)
        ranges = caster.ranges(data, np.zeros(3), np.array([[1.0, 0, 0], [0, 1.0, 0]]))
        assert ranges.tolist() == [pytest.approx(x - 0.2), np.inf]


@pytest.mark.parametrize("seed", range(4))
def test_single_rays_agree_with_mujoco(seed):
    model, data = random_solids(seed, count=60, spread_m=2.0)
    angles = np.linspace(-np.pi, np.pi, 360, endpoint=False)
    directions = np.stack((np.cos(angles), np.sin(angles), np.full(360, -0.05)), axis=1)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    origin = np.array([0.1, 0.2, 0.9])
    ranges = RayCaster(model).ranges(data, origin, directions)
    reference = mujoco_ranges(model, data, origin, directions)
    np.testing.assert_allclose(ranges, reference, rtol=1e-9, atol=1e-9)
    near = RayCaster(model).ranges(data, origin, directions, far_m=1.0)
    np.testing.assert_allclose(near, np.where(reference <= 1.0, reference, np.inf), rtol=1e-9, atol=1e-9)


def test_rays_along_the_axes_of_a_solid():
    """Directions with zero components, where slabs and cylinders divide by nothing."""
    spec = mujoco.MjSpec()
    for kind, x in zip(KINDS, (0.0, 2.0, 4.0, 6.0, 8.0), strict=True):
        spec.worldbody.add_geom(type=kind, size=[0.3, 0.2, 0.1], pos=[x, 0, 0])
    model, data = compiled(spec)
    down = np.array([[0.0, 0.0, -1.0]])
    for x in (0.0, 0.25, 2.0, 2.25, 3.0, 4.0, 6.0, 6.25, 8.0):
        origin = np.array([x, 0.0, 3.0])
        ranges = RayCaster(model).ranges(data, origin, down)
        np.testing.assert_allclose(ranges, mujoco_ranges(model, data, origin, down), rtol=1e-9)


def test_a_geom_that_cannot_be_cast_is_refused_by_name():
    spec = mujoco.MjSpec()
    spec.add_hfield(name="hill", nrow=2, ncol=2, size=[1, 1, 1, 1], userdata=[0, 0, 0, 1])
    spec.worldbody.add_geom(name="ramp", type=GEOM.mjGEOM_HFIELD, hfieldname="hill")
    model, _ = compiled(spec)
    with pytest.raises(ConfigurationError, match="'ramp' is a hfield"):
        RayCaster(model)
