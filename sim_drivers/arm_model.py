"""Franka's arm as a MuJoCo model: the links of `configs/models/panda.urdf`, rotors, gravity compensation and servos."""

from __future__ import annotations

import math
from importlib import resources
from typing import Any

import mujoco
import numpy as np

from drivers.interface.arm_motion import JOINTS, PANDA
from sim_drivers.mechanics import add_position_servo
from sim_drivers.world import FLOOR_BIT, OBSTACLE_BIT

MODEL = "models/panda.urdf"  # in configs
STIFFNESS_NM_RAD = np.array([3000.0, 3000.0, 3000.0, 2500.0, 2500.0, 2000.0, 2000.0])  # libfranka's own examples' impedance
DAMPING_NM_S_RAD = np.array([140.0, 140.0, 120.0, 110.0, 55.0, 45.0, 42.0])  # near critical with the rotors' inertia
# Inertia of the rotors seen through the gears, as Franka gave it to the authors of Drake's model (of the FR3, same drives).
ROTOR_INERTIA_KG_M2 = (0.6057, 0.6057, 0.4625, 0.4625, 0.2055, 0.2055, 0.2055)

# A servo damps the joint's own velocity; a set point that leads by this much of its velocity is not held back by that.
LEAD_S = DAMPING_NM_S_RAD / STIFFNESS_NM_RAD  # (7,)


def panda_joint(name: str, index: int) -> str:
    """Return what joint `index` (from 0), and its servo, of the arm of this name is called in the model."""
    return f"{name}_panda_joint{index + 1}"


def attach_panda(spec: Any, base: Any, name: str, mount_m: tuple[float, float, float], yaw_rad: float) -> None:
    """Attach the arm to a body of the `mujoco.MjSpec`, link0 at `mount_m` turned by `yaw_rad`, everything called `name`_...."""
    arm = mujoco.MjSpec.from_string(resources.files("configs").joinpath(MODEL).read_text(encoding="utf-8"))
    arm.compiler.fusestatic = False  # keep the flange
    for body in arm.bodies:
        body.gravcomp = 1.0
    for geom in arm.geoms:
        geom.contype, geom.conaffinity = 0, FLOOR_BIT | OBSTACLE_BIT
    for joint, rotor in zip(arm.joints, ROTOR_INERTIA_KG_M2, strict=True):
        joint.armature = rotor
    mount = base.add_frame(pos=list(mount_m), quat=[math.cos(yaw_rad / 2), 0, 0, math.sin(yaw_rad / 2)])
    spec.attach(arm, frame=mount, prefix=f"{name}_")
    for index in range(JOINTS):
        stiffness, damping = float(STIFFNESS_NM_RAD[index]), float(DAMPING_NM_S_RAD[index])
        add_position_servo(spec, panda_joint(name, index), stiffness, damping, float(PANDA.torque_nm[index]))
