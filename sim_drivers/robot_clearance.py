"""How near the robot's own geoms come to the obstacles: signed, surface to surface."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from sim_drivers.ray_caster import subtree_geoms
from sim_drivers.world import OBSTACLE_BIT

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
_FAR_M = 1e6  # mj_geomDistance never returns more


@kernel()
def _lower_bounds(pairs: I64, position: F64, rotation: F64, radius: F64, box: F64, bounds: F64) -> None:
    """Write, for pairs (n, 2) of robot geom and obstacle, the distance from the first's sphere to the second's own box (n,)."""
    for i in range(len(pairs)):
        robot, obstacle = pairs[i, 0], pairs[i, 1]
        squared = 0.0
        for axis in range(3):
            local = -box[obstacle, axis]
            for k in range(3):
                local += rotation[obstacle, 3 * k + axis] * (position[robot, k] - position[obstacle, k])
            outside = abs(local) - box[obstacle, 3 + axis]
            if outside > 0.0:
                squared += outside * outside
        bounds[i] = np.sqrt(squared) - radius[robot]


class RobotClearance:
    """Measures `mj_geomDistance` over the pairs that may decide, nearest lower bound first.

    The robot is everything attached to one body; obstacles are all other geoms with the obstacle contact bit that the robot's
    geom would collide with.  The floor is none.
    """

    def __init__(self, model: Any, robot: str = "base") -> None:
        """Find the pairs in a compiled `mujoco.MjModel`."""
        self._model = model
        self._radius, self._box = model.geom_rbound, model.geom_aabb
        own = subtree_geoms(model, robot)
        obstacles = np.flatnonzero(~own & (model.geom_contype & OBSTACLE_BIT != 0)).tolist()
        pairs = [(r, o) for r in np.flatnonzero(own).tolist() for o in obstacles if _collide(model, r, o)]
        self._pairs = np.array(pairs, dtype=np.int64).reshape(-1, 2)  # (n, 2)

    def measure(self, data: Any) -> tuple[float, tuple[str, ...]]:
        """Return the least distance [m] (negative: as deep as it penetrates; inf: no obstacles) and what is touched, by name."""
        model, pairs = self._model, self._pairs
        bounds = np.empty(len(pairs))
        _lower_bounds(pairs, data.geom_xpos, data.geom_xmat, self._radius, self._box, bounds)
        least, touched = np.inf, []
        while len(bounds):
            nearest = int(bounds.argmin())
            if bounds[nearest] > max(least, 0.0):  # the rest is farther than what was found, and touches nothing
                break
            bounds[nearest] = np.inf
            robot, obstacle = pairs[nearest]
            distance = mujoco.mj_geomDistance(model, data, robot, obstacle, _FAR_M, None)
            least = min(least, distance)
            if distance <= 0.0:
                touched.append(self._name(obstacle))
        return float(least), tuple(sorted(set(touched)))

    def _name(self, geom: int) -> str:
        found = self._model.geom(geom)
        return str(found.name or self._model.body(int(found.bodyid[0])).name)


def _collide(model: Any, one: int, other: int) -> bool:
    """MuJoCo's rule: the contype of one meets the conaffinity of the other."""
    met = (model.geom_contype[one] & model.geom_conaffinity[other]) | (model.geom_contype[other] & model.geom_conaffinity[one])
    return bool(met)
