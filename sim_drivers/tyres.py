"""How tyres hold on to the floor: Coulomb's friction, reached by creeping.

MuJoCo's own friction is the convex relaxation of Coulomb's: a contact that slides at v pushes up as if it closed in with mu v
(Todorov, Convex and analytically-invertible dynamics with contacts and constraints, ICRA 2014).  A wheel rolls and does not
feel it; four tyres that are dragged sideways are lifted off the floor, fall back, and the base shakes.  So the contacts carry
the weight only, without friction, and what holds tyres along the floor is a force of our own at each of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from sim_drivers.world import MujocoWorld

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

CREEP_M_S = 0.1  # a tyre that slips so fast holds with 0.71 of all its grip; rubber at walking pace: a slip of 0.1 to 0.2


class _Arrays(NamedTuple):
    """The compiled world's own, looked up once: they change as it goes on.  `hold` says what they are."""

    motion: F64  # (bodies, 6)
    centre: F64  # (3,)
    place: F64  # (bodies, 3)
    sensed: F64  # (numbers of all sensors,)
    applied: F64  # (bodies, 6)


class Tyres:
    """The tyres of a base, a part of the world: at every step they are told their load, and hold."""

    max_step_s = 0.0025
    period_ns = 2_500_000

    def __init__(self, wheels: Sequence[str], friction: float) -> None:
        """Take the names of the wheels' bodies, which stand in the model before `build`."""
        self._wheels, self._friction = tuple(wheels), friction
        self._bodies, self._loads = np.zeros(0, np.int64), np.zeros(0, np.int64)
        self._at: _Arrays | None = None

    def build(self, spec: Any, base: Any) -> None:
        """Let MuJoCo tell each wheel's load.  The sensor's place is larger than the wheel: all its contacts count."""
        for name in self._wheels:
            wheel = spec.body(name)
            reach_m = max(float(np.max(geom.size)) for geom in wheel.geoms) + 0.02
            wheel.add_site(name=f"{name}_load", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[reach_m, 0, 0])
            spec.add_sensor(
                name=f"{name}_load", type=mujoco.mjtSensor.mjSENS_TOUCH, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=f"{name}_load"
            )

    def bind(self, world: MujocoWorld) -> None:
        """Find wheels and sensors."""
        model = world.model
        self._bodies = np.array([model.body(name).id for name in self._wheels], np.int64)
        self._loads = np.array([model.sensor(f"{name}_load").adr[0] for name in self._wheels], np.int64)
        data, root = world.data, int(model.body_rootid[self._bodies[0]])
        self._at = _Arrays(data.cvel, data.subtree_com[root], data.xpos, data.sensordata, data.xfrc_applied)

    def act(self, world: MujocoWorld) -> None:
        """Hold for the next step as the velocities now, and the loads of the step before, have it."""
        at = self._at
        assert at is not None  # bound before the world acts
        hold(self._bodies, at.motion, at.centre, at.place, at.sensed[self._loads], self._friction, at.applied)


@kernel()
def hold(bodies: I64, motion: F64, centre: F64, place: F64, load_n: F64, friction: float, applied: F64) -> None:
    """Write the force and torque on each wheel that its grip on the floor makes.

    Args:
        bodies: ids of the wheels, shape (n,).
        motion: turning and moving of every body, seen at `centre`, shape (bodies, 6).
        centre: the centre of mass of the whole base, shape (3,) [m].
        place: where every body's centre is, shape (bodies, 3) [m]; the floor is z = 0.
        load_n: on each wheel, shape (n,) [N].
        friction: between tyre and floor.
        applied: force [N] and torque [N m] on every body, shape (bodies, 6); written to.
    """
    for i in range(len(bodies)):
        b = bodies[i]
        wx, wy, wz = motion[b, 0], motion[b, 1], motion[b, 2]
        rx, ry, rz = place[b, 0] - centre[0], place[b, 1] - centre[1], -centre[2]
        slip_x = motion[b, 3] + wy * rz - wz * ry
        slip_y = motion[b, 4] + wz * rx - wx * rz
        grip = -friction * load_n[i] / np.sqrt(slip_x * slip_x + slip_y * slip_y + CREEP_M_S * CREEP_M_S)
        fx, fy, z = grip * slip_x, grip * slip_y, place[b, 2]
        applied[b, 0], applied[b, 1], applied[b, 2] = fx, fy, 0.0
        applied[b, 3], applied[b, 4], applied[b, 5] = z * fy, -z * fx, 0.0  # (0, 0, -z) x f
