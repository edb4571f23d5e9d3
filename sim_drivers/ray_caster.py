"""Depth images and single rays of a MuJoCo model by ray casting, without a graphics library."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivers.interface.errors import ConfigurationError
from drivers.interface.samples import Intrinsics
from sim_drivers.depth_kernels import draw_depth
from sim_drivers.ray_kernels import BOX, CAPSULE, CYLINDER, ELLIPSOID, PLANE, SPHERE, cast_rays

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]


class RayCaster:
    """Sees every visible geom of a model but those of one body's subtree.

    MuJoCo's own `mj_multiRay` tests every ray against every geom; this one draws each geom into the pixels that it can cover.
    """

    def __init__(self, model: Any, without_subtree: str | None = None) -> None:
        """Take over the geoms of a compiled `mujoco.MjModel`.

        Args:
            model: the compiled model.
            without_subtree: name of a body that is not seen, nor anything that is attached to it.

        Raises:
            ConfigurationError: a geom is of a type that cannot be cast.
        """
        self._ids = visible_geoms(model, without_subtree)  # (n,)
        self._kinds: I64 = model.geom_type[self._ids].astype(np.int64)  # (n,)
        unknown = ~np.isin(self._kinds, (PLANE, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX))
        if unknown.any():
            geom = model.geom(int(self._ids[np.argmax(unknown)]))
            kind = mujoco.mjtGeom(int(geom.type[0])).name.removeprefix("mjGEOM_").lower()
            raise ConfigurationError(
                f"geom '{geom.name or geom.id}' is a {kind}, which the depth camera cannot see; "
                "it sees plane, box, cylinder, sphere, capsule and ellipsoid"
            )
        self._sizes = _sizes(self._kinds, model.geom_size[self._ids])  # (n, 3)
        self._extents: F64 = model.geom_aabb[self._ids, 3:]  # (n, 3)

    def depth_image(self, data: Any, position: F64, rotation: F64, intrinsics: Intrinsics, far_m: float = np.inf) -> F32:
        """Return the depth along the optical axis [m], shape (height, width); inf where nothing is within `far_m`.

        Args:
            data: the `mujoco.MjData`, its kinematics up to date.
            position: of the camera in the map, (3,) [m].
            rotation: map from the optical frame (x right, y down, z forward), (3, 3).
            intrinsics: the image; the centre of pixel (row, column) lies at v = row, u = column.
            far_m: greatest depth.
        """
        depth = np.empty((intrinsics.height, intrinsics.width), np.float32)
        pinhole = np.array([intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy])
        draw_depth(*self._solids(data), position, rotation, pinhole, far_m, depth)
        return depth

    def ranges(self, data: Any, origin: F64, directions: F64, far_m: float = np.inf) -> F64:
        """Return how far unit directions (m, 3) reach from one origin (3,) in the map: (m,) [m], inf beyond `far_m`."""
        ranges = np.empty(len(directions))
        cast_rays(*self._solids(data), origin, directions, far_m, ranges)
        return ranges

    def _solids(self, data: Any) -> tuple[I64, F64, F64, F64, F64]:
        rotations = data.geom_xmat[self._ids].reshape(-1, 3, 3)
        return self._kinds, self._sizes, self._extents, data.geom_xpos[self._ids], rotations


def subtree_geoms(model: Any, root: str) -> NDArray[np.bool_]:
    """Return which geoms belong to a body or to anything attached to it, (geoms,)."""
    inside = np.zeros(model.nbody, dtype=np.bool_)
    inside[model.body(root).id] = True
    for body in range(1, model.nbody):  # parents come before their children
        inside[body] |= inside[model.body_parentid[body]]
    mask: NDArray[np.bool_] = inside[model.geom_bodyid]
    return mask


def visible_geoms(model: Any, without_subtree: str | None) -> NDArray[np.intp]:
    """Return the ids of the geoms that are not fully transparent (MuJoCo's rays pass those too) and not in the subtree."""
    visible = model.geom_rgba[:, 3] > 0.0
    if without_subtree is not None:
        visible &= ~subtree_geoms(model, without_subtree)
    return np.flatnonzero(visible)


def _sizes(kinds: I64, sizes: F64) -> F64:
    sizes = sizes.copy()
    sphere, plane = kinds == SPHERE, kinds == PLANE
    sizes[sphere] = sizes[sphere, :1]
    sizes[plane] = np.where(sizes[plane] > 0.0, sizes[plane], np.inf)
    return sizes
