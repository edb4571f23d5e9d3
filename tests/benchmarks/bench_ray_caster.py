"""The ray caster, and MuJoCo's own rays on the same scenes as the peer."""

from collections.abc import Callable

import mujoco
import numpy as np

from drivers.interface.geometry import BODY_FROM_OPTICAL, SE3
from drivers.interface.samples import Intrinsics
from sim_drivers.ray_caster import RayCaster

PEER = "mj_multiRay"
MAP_FROM_OPTICAL = SE3.from_euler(0.0, 0.0, 0.4, 0.0, 0.1, 0.0) @ BODY_FROM_OPTICAL


def hall(geoms: int):
    """A walled hall with cylinders of a BARN world: `geoms` geoms in all."""
    rng = np.random.default_rng(0)
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])
    walls = (([5, 3.2], [10, 0.05]), ([5, -3.2], [10, 0.05]), ([9, 0], [0.05, 5]), ([-3, 0], [0.05, 5]))
    for centre, half in walls:
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[*half, 0.5], pos=[*centre, 0.5])
    for _ in range(geoms - 5):
        x, y = rng.uniform(0.6, 8.0), rng.uniform(-3.0, 3.0)
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[0.075, 0.5, 0], pos=[x, y, 0.5])
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def d455(width: int, height: int) -> Intrinsics:
    u, v = width / 848, height / 480
    return Intrinsics(width, height, 434.27 * u, 434.27 * v, 431.77 * u, 240.45 * v)


def ours(geoms: int, width: int, height: int) -> Callable[[], object]:
    model, data = hall(geoms)
    caster, intrinsics = RayCaster(model), d455(width, height)
    position, rotation = MAP_FROM_OPTICAL.translation, MAP_FROM_OPTICAL.rotation
    return lambda: caster.depth_image(data, position, rotation, intrinsics)


def peer(geoms: int, width: int, height: int) -> Callable[[], object]:
    """`mj_multiRay` with the rays prepared beforehand."""
    model, data = hall(geoms)
    k = d455(width, height)
    v, u = np.mgrid[:height, :width]
    rays = np.stack(((u - k.cx) / k.fx, (v - k.cy) / k.fy, np.ones(u.shape)), axis=-1).reshape(-1, 3)
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    flat, count = (rays @ MAP_FROM_OPTICAL.rotation.T).ravel(), len(rays)
    position, ids, ranges = MAP_FROM_OPTICAL.translation, np.empty(count, np.int32), np.empty(count)
    return lambda: mujoco.mj_multiRay(model, data, position, flat, None, 1, -1, ids, ranges, None, count, 1e10)


SIZES = {
    "raycast_283x160_40_geoms": (40, 283, 160),
    "raycast_283x160_350_geoms": (350, 283, 160),
    "raycast_160x90_40_geoms": (40, 160, 90),
}


def cases() -> list[tuple[str, Callable[[], object]]]:
    """Return what is timed, by name."""
    return [(name, ours(*size)) for name, size in SIZES.items()]


def peers() -> list[tuple[str, Callable[[], object]]]:
    """Return the peer of each case, by the same name."""
    return [(name, peer(*size)) for name, size in SIZES.items()]
