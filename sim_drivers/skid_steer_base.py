"""A four-wheel skid-steer base of the Jackal class, on the floor by contact."""

from __future__ import annotations

from itertools import product
from typing import Annotated, Any, ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.devices import DeviceSetup
from drivers.interface.kinematics import SkidSteer
from drivers.interface.settings import Settings
from sim_drivers.mechanics import add_velocity_servo, set_inertia
from sim_drivers.tyres import Tyres
from sim_drivers.wheel_encoders import EncoderSettings
from sim_drivers.wheeled_base import WheeledBase, WheeledBaseSettings
from sim_drivers.world import FLOOR_BIT, OBSTACLE_BIT, MujocoWorld, require_world

Fraction = Annotated[float, Field(ge=-0.2, le=0.2)]

WHEELS = ("front_left", "front_right", "rear_left", "rear_right")
# Clearpath's data sheet and its jackal_description package: outline, wheels, masses and moments.
LENGTH_M, WIDTH_M, HEIGHT_M = 0.508, 0.430, 0.250
WHEELBASE_M, TRACK_M, WHEEL_WIDTH_M = 0.262, 0.37559, 0.040
WHEEL_MASS_KG, WHEEL_INERTIA_KG_M2 = 0.477, (0.0013, 0.0024, 0.0013)
BODY_CENTRE_M, BODY_INERTIA_KG_M2 = (0.012, 0.002, 0.1305), (0.3136, 0.3922, 0.4485)
GROUND_CLEARANCE_M = 0.065
# Stand-in's own: nothing is published.
ROTOR_INERTIA_KG_M2 = 0.1  # of the motor, seen through its gear
SERVO_GAIN_NM_S = 40.0
TYRE_TIME_S = 0.04  # contact time constant: the tyre gives by about a millimetre


class SkidSteerSettings(WheeledBaseSettings):
    """Geometry and mass are Clearpath's published figures for the Jackal; the speed cap is what suits indoors (it does 2 m/s)."""

    max_vx_m_s: float = Field(default=1.0, gt=0.0, le=2.0, description="cap forwards and backwards")
    max_vy_m_s: float = Field(default=0.0, ge=0.0, le=0.0, description="it cannot move sideways")
    max_wz_rad_s: float = Field(default=2.0, gt=0.0, le=4.0, description="cap on turning")
    mass_kg: float = Field(default=17.0, gt=4.0, le=40.0, description="of the whole base, wheels included")
    wheel_radius_m: float = Field(default=0.098, gt=0.05, le=0.2, description="nominal")
    effective_track_m: float = Field(
        default=0.56,
        gt=0.1,
        le=2.0,
        description="nominal; measured in the simulator, and near track + wheelbase^2 / track, where point contacts balance",
    )
    wheel_radius_error: tuple[Fraction, Fraction, Fraction, Fraction] = Field(
        default=(0.001, -0.0005, 0.0005, -0.001),
        description="how much larger each wheel really is, as a fraction (air)",
    )
    friction: float = Field(default=0.6, gt=0.05, le=2.0, description="between tyres and floor")
    wheel_torque_nm: float = Field(default=8.0, gt=0.0, le=100.0, description="what a wheel's motor gives at most")
    encoders: EncoderSettings = Field(
        default_factory=lambda: EncoderSettings(counts_per_rev=48_000), description="wheel encoders; before the gear, so fine"
    )


class SkidSteerChassis:
    """A free body on four driven wheels.  Turning drags every tyre sideways: slip is all there is to it (`sim_drivers/tyres.py`).

    A wheel touches the floor in one point.  In a quasi-static turn the moments of the four friction forces balance when the
    effective track is track + wheelbase^2 / track = 0.558 m, whatever the friction, the load on a wheel and the rate; that is
    1.49 times the geometric track, and Clearpath's own controller configuration uses 1.5.  In a fast curve it shrinks.
    """

    max_step_s = 0.0025
    period_ns = 2_500_000

    def __init__(self, settings: SkidSteerSettings) -> None:
        """Take the settings."""
        self._settings = settings
        self.tyres = Tyres(WHEELS, settings.friction)  # a part of its own: they hold at every step, whoever drives the wheels
        self._qpos: list[int] = []
        self._ctrl = np.zeros(0)  # the compiled world's own

    def build(self, spec: Any, base: Any) -> None:
        """Add the body, the wheels and their drives."""
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC  # a pyramid grips better along its edges than across
        base.add_freejoint()
        body_kg = self._settings.mass_kg - len(WHEELS) * WHEEL_MASS_KG
        set_inertia(base, body_kg, BODY_CENTRE_M, BODY_INERTIA_KG_M2)
        half_height = (HEIGHT_M - GROUND_CLEARANCE_M) / 2
        base.add_geom(
            name="chassis",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[LENGTH_M / 2, WIDTH_M / 2, half_height],
            pos=[0, 0, GROUND_CLEARANCE_M + half_height],
            contype=0,
            conaffinity=OBSTACLE_BIT,
            rgba=[0.9, 0.7, 0.1, 1.0],
        )
        sides = product((WHEELBASE_M / 2, -WHEELBASE_M / 2), (TRACK_M / 2, -TRACK_M / 2))
        for name, place, error in zip(WHEELS, sides, self._settings.wheel_radius_error, strict=True):
            self._add_wheel(base, name, place, (1.0 + error) * self._settings.wheel_radius_m)
            add_velocity_servo(spec, name, SERVO_GAIN_NM_S, self._settings.wheel_torque_nm)

    def bind(self, world: MujocoWorld) -> None:
        """Find wheels and drives."""
        self._qpos = [int(world.model.joint(name).qposadr[0]) for name in WHEELS]
        first = int(world.model.actuator(WHEELS[0]).id)
        self._ctrl = world.data.ctrl[first : first + len(WHEELS)]

    def drive(self, world: MujocoWorld, wheel_rates: NDArray[np.float64]) -> None:
        """Run the wheels at these rates [rad/s], shape (4,), as far as torque and grip allow."""
        self._ctrl[:] = wheel_rates

    def wheel_angles(self, world: MujocoWorld) -> NDArray[np.float64]:
        """Return how far the wheels have turned [rad], shape (4,)."""
        return np.asarray(world.data.qpos[self._qpos], dtype=np.float64)

    def _add_wheel(self, base: Any, name: str, place_m: tuple[float, float], radius_m: float) -> None:
        wheel = base.add_body(name=name, pos=[*place_m, self._settings.wheel_radius_m])
        wheel.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0], armature=ROTOR_INERTIA_KG_M2)
        set_inertia(wheel, WHEEL_MASS_KG, (0.0, 0.0, 0.0), WHEEL_INERTIA_KG_M2)
        wheel.add_geom(
            type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,  # bulges like a tyre, and touches in one point where a cylinder's edge chatters
            size=[radius_m, WHEEL_WIDTH_M / 2, radius_m],
            contype=0,
            conaffinity=FLOOR_BIT,
            condim=1,  # it carries; what holds it along the floor are the tyres
            solref=[TYRE_TIME_S, 1.0],
            priority=1,  # so that this counts, not what the floor is made of
            rgba=[0.1, 0.1, 0.1, 1.0],
        )


class SimSkidSteerBase(WheeledBase):
    """A simulated four-wheel skid-steer base."""

    Settings: ClassVar[type[Settings]] = SkidSteerSettings
    role: ClassVar[str] = "base"

    def __init__(self, settings: SkidSteerSettings, setup: DeviceSetup) -> None:
        """Join the world.

        Raises:
            ConfigurationError: there is no simulated world.
        """
        nominal = SkidSteer(settings.wheel_radius_m, settings.effective_track_m, len(WHEELS))
        chassis = SkidSteerChassis(settings)
        super().__init__(settings, setup, chassis, nominal)
        require_world(setup).add(chassis.tyres)
