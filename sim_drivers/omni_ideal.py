"""An omni base on planar joints: it goes where its wheels would take it, upright, whatever the floor."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivers.interface.kinematics import OmniThreeWheel
from sim_drivers.mechanics import add_velocity_servo, set_inertia
from sim_drivers.world import OBSTACLE_BIT, MujocoWorld

JOINTS = ("base_x", "base_y", "base_yaw")
SERVO_TIME_S = 0.01  # of the velocity servos, added to the drives' own lag
GRIP = 0.7  # the servos push no harder than wheels with this coefficient of friction could


class IdealOmniChassis:
    """Two slides and a hinge, run by velocity servos.

    The wheels exist only as arithmetic: `true` says how fast the body moves for given wheel rates, and how far wheels would
    have turned for the way that the body really made.  Slip is a random walk of each wheel's travel whose variance grows
    with the distance (Chong and Kleeman, Accurate odometry and error modelling for a mobile robot, ICRA 1997).
    """

    max_step_s = 0.005
    period_ns = 5_000_000

    def __init__(
        self,
        true: OmniThreeWheel,
        mass_kg: float,
        size_m: tuple[float, float],
        slip_m_per_sqrt_m: float,
        rng: np.random.Generator,
    ) -> None:
        """Take the true geometry, the mass, and radius and height of the body; slip is drawn from `rng`."""
        self._rates_from_twist = true.rates_from_twist  # (3, 3)
        self._twist_from_rates = np.linalg.inv(self._rates_from_twist)
        self._wheel_radius_m = np.array(true.wheel_radius_m)
        self._mass_kg = mass_kg
        self._slip = slip_m_per_sqrt_m
        self._radius_m, self._height_m = size_m
        self._rng = rng
        self._angle_rad = np.zeros(3)
        self._pose = np.zeros(3)  # x, y [m], yaw [rad] since the start, in the frame of the start
        self._qpos = self._ctrl = slice(0, 0)

    def build(self, spec: Any, base: Any) -> None:
        """Add the planar joints, their servos and one upright cylinder."""
        inertia = 0.5 * self._mass_kg * self._radius_m**2
        set_inertia(base, self._mass_kg, (0.0, 0.0, self._height_m / 2), (inertia, inertia, inertia))
        base.add_joint(name=JOINTS[0], type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0])
        base.add_joint(name=JOINTS[1], type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 1, 0])
        base.add_joint(name=JOINTS[2], type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        base.add_geom(
            name="chassis",
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=[self._radius_m, self._height_m / 2, 0],
            pos=[0, 0, self._height_m / 2],
            contype=0,
            conaffinity=OBSTACLE_BIT,
            rgba=[0.2, 0.4, 0.8, 1.0],
        )
        grip_n = GRIP * 9.81 * self._mass_kg
        add_velocity_servo(spec, JOINTS[0], self._mass_kg / SERVO_TIME_S, grip_n)
        add_velocity_servo(spec, JOINTS[1], self._mass_kg / SERVO_TIME_S, grip_n)
        add_velocity_servo(spec, JOINTS[2], inertia / SERVO_TIME_S, grip_n * self._radius_m)

    def bind(self, world: MujocoWorld) -> None:
        """Find joints and servos."""
        first = int(world.model.joint(JOINTS[0]).qposadr[0])
        servo = int(world.model.actuator(JOINTS[0]).id)
        self._qpos, self._ctrl = slice(first, first + 3), slice(servo, servo + 3)

    def drive(self, world: MujocoWorld, wheel_rates: NDArray[np.float64]) -> None:
        """Run at the twist that these wheel rates [rad/s], shape (3,), really give."""
        self._roll(world.data.qpos[self._qpos].copy())
        vx, vy, wz = self._twist_from_rates @ wheel_rates
        c, s = math.cos(self._pose[2]), math.sin(self._pose[2])
        world.data.ctrl[self._ctrl] = c * vx - s * vy, s * vx + c * vy, wz

    def wheel_angles(self, world: MujocoWorld) -> NDArray[np.float64]:
        """Return how far the wheels have turned [rad], shape (3,)."""
        return self._angle_rad

    def _roll(self, pose: NDArray[np.float64]) -> None:
        """Turn the wheels for the way from the last pose to this one, at the heading halfway between."""
        dx, dy, turned = pose - self._pose
        heading = self._pose[2] + turned / 2
        c, s = math.cos(heading), math.sin(heading)
        rolled = self._rates_from_twist @ (c * dx + s * dy, c * dy - s * dx, turned)  # (3,)
        spread = self._slip * np.sqrt(np.abs(rolled) / self._wheel_radius_m)
        self._angle_rad = self._angle_rad + rolled + spread * self._rng.standard_normal(3)
        self._pose = pose
