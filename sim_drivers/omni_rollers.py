"""An omni base that stands on three wheels of passive rollers and is moved by nothing but their grip on the floor."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from drivers.interface.kinematics import OmniThreeWheel
from sim_drivers.mechanics import add_velocity_servo, set_inertia
from sim_drivers.world import FLOOR_BIT, OBSTACLE_BIT, MujocoWorld

WHEELS = ("wheel_0", "wheel_1", "wheel_2")
ROLLERS = 10  # per wheel
ROLLER_RADIUS_M = 0.0125  # at the thickest place
ROLLER_MASS_KG = 0.008
ROLLER_DAMPING_NM_S = 1e-4  # bearing drag, about 0.2 N a wheel at 0.4 m/s sideways
HUB_MASS_KG = 0.1
HUB_INERTIA_KG_M2 = (1.5e-4, 1e-4, 1e-4)
ROTOR_INERTIA_KG_M2 = 0.005  # of the motor, seen through its gear
SERVO_GAIN_NM_S = 2.0
FRICTION = 0.7  # rubber on a smooth floor
CONTACT_TIME_S = 0.005
GROUND_CLEARANCE_M = 0.02


class RollerOmniChassis:
    """A free body on three omni wheels; slip comes out of the contact, not out of a setting.

    Each roller is an ellipsoid that spins about the tangent of its wheel.  Its length is chosen so that the outline of the
    wheel closes: where one roller hands over to the next, the support height is the wheel's radius again.
    """

    max_step_s = 0.0025
    period_ns = 2_500_000

    def __init__(self, true: OmniThreeWheel, mass_kg: float, size_m: tuple[float, float], torque_limit_nm: float) -> None:
        """Take the true geometry, the whole mass, radius and height of the body, and what a motor gives."""
        self._true = true
        self._body_kg = mass_kg - 3 * (HUB_MASS_KG + ROLLERS * ROLLER_MASS_KG)
        self._torque_limit_nm = torque_limit_nm
        self._radius_m, self._height_m = size_m
        self._qpos: list[int] = []
        self._ctrl = np.zeros(0)  # the compiled world's own

    def build(self, spec: Any, base: Any) -> None:
        """Add the body, the wheels and their drives."""
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC  # a pyramid grips better along its edges than across
        base.add_freejoint()
        half_height = (self._height_m - GROUND_CLEARANCE_M) / 2
        centre = (0.0, 0.0, GROUND_CLEARANCE_M + 0.7 * half_height)  # batteries and motors sit low
        across = self._body_kg * (self._radius_m**2 / 4 + half_height**2 / 3)
        set_inertia(base, self._body_kg, centre, (across, across, self._body_kg * self._radius_m**2 / 2))
        base.add_geom(
            name="chassis",
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=[self._radius_m, half_height, 0],
            pos=[0, 0, GROUND_CLEARANCE_M + half_height],
            contype=0,
            conaffinity=OBSTACLE_BIT,
            rgba=[0.2, 0.4, 0.8, 1.0],
        )
        for index, name in enumerate(WHEELS):
            self._add_wheel(base, index, name)
            add_velocity_servo(spec, name, SERVO_GAIN_NM_S, self._torque_limit_nm)

    def bind(self, world: MujocoWorld) -> None:
        """Find wheels and drives."""
        self._qpos = [int(world.model.joint(name).qposadr[0]) for name in WHEELS]
        first = int(world.model.actuator(WHEELS[0]).id)
        self._ctrl = world.data.ctrl[first : first + 3]

    def drive(self, world: MujocoWorld, wheel_rates: NDArray[np.float64]) -> None:
        """Run the wheels at these rates [rad/s], shape (3,), as far as torque and grip allow."""
        self._ctrl[:] = wheel_rates

    def wheel_angles(self, world: MujocoWorld) -> NDArray[np.float64]:
        """Return how far the wheels have turned [rad], shape (3,)."""
        return np.asarray(world.data.qpos[self._qpos], dtype=np.float64)

    def _add_wheel(self, base: Any, index: int, name: str) -> None:
        radius_m, distance_m = self._true.wheel_radius_m[index], self._true.wheel_distance_m[index]
        bearing = self._true.wheel_bearing_rad[index]
        axle = bearing + self._true.heading_error_rad[index]
        wheel = base.add_body(  # its x axis points outwards along the axle
            name=name,
            pos=[distance_m * math.cos(bearing), distance_m * math.sin(bearing), radius_m],
            quat=[math.cos(axle / 2), 0, 0, math.sin(axle / 2)],
        )
        wheel.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[-1, 0, 0], armature=ROTOR_INERTIA_KG_M2)
        set_inertia(wheel, HUB_MASS_KG, (0.0, 0.0, 0.0), HUB_INERTIA_KG_M2)
        half_length_m = _closing_half_length(radius_m)
        for roller in range(ROLLERS):
            _add_roller(wheel, 2 * math.pi * roller / ROLLERS, radius_m, half_length_m)


def _add_roller(wheel: Any, place: float, wheel_radius_m: float, half_length_m: float) -> None:
    hub_m = wheel_radius_m - ROLLER_RADIUS_M
    body = wheel.add_body(
        pos=[0, hub_m * math.sin(place), hub_m * math.cos(place)],
        quat=[math.cos(place / 2), -math.sin(place / 2), 0, 0],
    )
    body.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0], armature=1e-6, damping=[ROLLER_DAMPING_NM_S, 0, 0])
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        size=[ROLLER_RADIUS_M, half_length_m, ROLLER_RADIUS_M],
        mass=ROLLER_MASS_KG,
        contype=0,
        conaffinity=FLOOR_BIT,
        friction=[FRICTION, 0, 0],
        solref=[CONTACT_TIME_S, 1.0],
        priority=1,  # its friction counts, not the larger one of the floor
        rgba=[0.1, 0.1, 0.1, 1.0],
    )


def _closing_half_length(wheel_radius_m: float) -> float:
    """Return the ellipsoid's half length with which the support height at the hand-over, half a pitch away, is the radius.

    Support height at angle p: (R - b) cos p + sqrt(a^2 sin^2 p + b^2 cos^2 p), with R the wheel's, b the roller's radius.
    """
    c, s = math.cos(math.pi / ROLLERS), math.sin(math.pi / ROLLERS)
    below_hub_m = wheel_radius_m - (wheel_radius_m - ROLLER_RADIUS_M) * c
    return math.sqrt(below_hub_m**2 - (ROLLER_RADIUS_M * c) ** 2) / s
