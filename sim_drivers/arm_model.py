"""Franka's arm as a MuJoCo model: the links of `configs/models/panda.urdf`, rotors, gravity compensation and servos."""

from __future__ import annotations

import math
from importlib import resources
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.arm_motion import JOINTS, PANDA
from drivers.interface.settings import Settings
from sim_drivers.mechanics import add_position_servo
from sim_drivers.world import FLOOR_BIT, OBSTACLE_BIT, MujocoWorld

F64 = NDArray[np.float64]
Joints = tuple[float, float, float, float, float, float, float]

READY_RAD: Joints = (0.0, -math.pi / 4, 0.0, -3 * math.pi / 4, 0.0, math.pi / 2, math.pi / 4)  # Franka's "ready" pose

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


class ArmBuild(Settings):
    """Where an arm is mounted, how it starts, and how well it measures itself."""

    mount_x_m: float = Field(default=0.0, ge=-2.0, le=2.0, description="of link0 in base")
    mount_y_m: float = Field(default=0.0, ge=-2.0, le=2.0, description="of link0 in base")
    mount_z_m: float = Field(default=0.0, ge=0.0, le=3.0, description="of link0 in base")
    mount_yaw_rad: float = Field(default=0.0, ge=-math.pi, le=math.pi, description="of link0 in base")
    start_rad: Joints = Field(default=READY_RAD, description="joint positions at the start of the world")
    position_resolution_rad: float = Field(default=1e-5, gt=0.0, le=0.01, description="step of the joint encoders")
    velocity_noise_rad_s: float = Field(default=0.002, ge=0.0, le=1.0, description="standard deviation")
    torque_noise_nm: float = Field(default=0.05, ge=0.0, le=10.0, description="standard deviation of the torque sensors")


class PandaJoints:
    """The seven joints and servos of one arm in the compiled model."""

    def __init__(self, build: ArmBuild, name: str) -> None:
        """Remember; nothing is in the model yet."""
        self._build = build
        self._name = name
        self._qpos = self._dof = self._ctrl = slice(0, 0)

    def attach(self, spec: Any, base: Any) -> None:
        """Attach the model in `configs/models/panda.urdf` to the base, with a servo for each joint."""
        b = self._build
        attach_panda(spec, base, self._name, (b.mount_x_m, b.mount_y_m, b.mount_z_m), b.mount_yaw_rad)

    def bind(self, world: MujocoWorld) -> None:
        """Look up the joints and put them where they start."""
        model, data = world.model, world.data
        joint_name = panda_joint(self._name, 0)
        joint = model.joint(joint_name)
        starts = int(joint.qposadr[0]), int(joint.dofadr[0]), int(model.actuator(joint_name).id)
        self._qpos, self._dof, self._ctrl = (slice(start, start + JOINTS) for start in starts)
        data.qpos[self._qpos] = self._build.start_rad
        mujoco.mj_step1(model, data)

    def drive(self, world: MujocoWorld, position_rad: F64, velocity_rad_s: F64) -> None:
        """Pull the joints to a set point that moves, both (7,)."""
        world.data.ctrl[self._ctrl] = position_rad + LEAD_S * velocity_rad_s

    def stiffen(self, world: MujocoWorld, stiffness_nm_rad: F64) -> None:
        """Change the servos' stiffness, shape (7,); their damping stays in proportion."""
        for index, stiffness in enumerate(stiffness_nm_rad.tolist()):
            servo = self._ctrl.start + index
            world.model.actuator_gainprm[servo, 0] = stiffness
            world.model.actuator_biasprm[servo, 1:3] = -stiffness, -stiffness * LEAD_S[index]

    def measure(self, world: MujocoWorld, rng: np.random.Generator) -> tuple[F64, F64, F64]:
        """Return position [rad], velocity [rad/s] and torque [N m] as encoders and sensors tell, each (7,)."""
        build, data = self._build, world.data
        step = build.position_resolution_rad
        position: F64 = np.round(data.qpos[self._qpos] / step) * step
        velocity = data.qvel[self._dof] + rng.normal(0.0, build.velocity_noise_rad_s, JOINTS)
        load = data.qfrc_actuator[self._dof] + data.qfrc_gravcomp[self._dof]
        return position, velocity, load + rng.normal(0.0, build.torque_noise_nm, JOINTS)

    def speed_rad_s(self, world: MujocoWorld) -> float:
        """Return how fast the fastest joint really turns."""
        return float(np.abs(world.data.qvel[self._dof]).max())

    def external_nm(self, world: MujocoWorld) -> F64:
        """Return the torque that contacts and end stops exert on the joints, shape (7,)."""
        return np.array(world.data.qfrc_constraint[self._dof])
