"""What every simulated base does, whatever its wheels: life cycle, commands, encoders, health."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.devices import DeviceHealth, DeviceSetup, DeviceState
from drivers.interface.errors import DeviceError
from drivers.interface.kinematics import WheelKinematics
from drivers.interface.samples import WheelSample
from drivers.interface.seeds import stream
from sim_drivers.actuation_noise import ActuationNoise, ActuationNoiseSettings
from sim_drivers.drive import Drive, DriveSettings
from sim_drivers.wheel_encoders import EncoderSettings, WheelEncoders
from sim_drivers.world import MujocoWorld, require_world


class WheeledBaseSettings(DriveSettings):
    """What all simulated bases have in common."""

    mass_kg: float = Field(default=6.0, gt=0.1, le=500.0, description="of the whole base, wheels included")
    encoders: EncoderSettings = Field(default_factory=EncoderSettings, description="wheel encoders")
    actuation_noise: ActuationNoiseSettings = ActuationNoiseSettings()


class Chassis(Protocol):
    """Body, wheels and drives of a base in the MuJoCo model; the true geometry, which `kinematics` only approximates."""

    max_step_s: float  # the largest physics step that it is still right with
    period_ns: int  # how often its drives take a new set point

    def build(self, spec: Any, base: Any) -> None:
        """Add its bodies, joints and actuators to the `mujoco.MjSpec`."""
        ...

    def bind(self, world: MujocoWorld) -> None:
        """Look up its addresses in the compiled model."""
        ...

    def drive(self, world: MujocoWorld, wheel_rates: NDArray[np.float64]) -> None:
        """Run the wheels at these rates [rad/s], shape (wheels,), as far as torque and traction allow."""
        ...

    def wheel_angles(self, world: MujocoWorld) -> NDArray[np.float64]:
        """Return how far each wheel has really turned [rad], shape (wheels,)."""
        ...


class WheeledBase:
    """A `MobileBase` in the simulated world: commands reach a chassis through a `Drive`, its wheels reach us through encoders."""

    def __init__(self, settings: WheeledBaseSettings, setup: DeviceSetup, chassis: Chassis, kinematics: WheelKinematics) -> None:
        """Join the world.

        Raises:
            ConfigurationError: there is no simulated world.
        """
        self._setup = setup
        self._settings = settings
        self._limits = settings.limits
        self._kinematics = kinematics
        self._rates_from_twist = _matrix_of(kinematics, self._limits)  # (wheels, 3)
        self._chassis = chassis
        self.max_step_s = chassis.max_step_s
        self.period_ns = chassis.period_ns
        self._drive = Drive(settings)
        self._state = DeviceState.CLOSED
        self._world = require_world(setup)
        self._reset()
        self._world.add(self)

    @property
    def limits(self) -> BaseLimits:
        """What it may be asked."""
        return self._limits

    @property
    def kinematics(self) -> WheelKinematics:
        """The nominal geometry, as a data sheet gives it."""
        return self._kinematics

    def open(self) -> None:
        """Start delivering; counters and noise begin anew."""
        if self._state is not DeviceState.OPEN:
            self._reset()
            self._state = DeviceState.OPEN

    def command(self, twist: BodyTwist, expires_ns: int) -> None:
        """Follow the twist until `expires_ns`, then brake.

        Raises:
            DeviceError: it is not finite, sideways on a base that cannot strafe, or the base is not open.
        """
        if not twist.finite:
            raise DeviceError(f"{self._setup.name}: the twist {twist} is not finite")
        if twist.vy != 0.0 and not self._limits.holonomic:
            raise DeviceError(f"{self._setup.name}: this base cannot move sideways; vy = {twist.vy} m/s was asked")
        if self._state is not DeviceState.OPEN:
            raise DeviceError(f"{self._setup.name} is not open and takes no commands")
        self._drive.command(twist, expires_ns, self._world.now_ns)

    def drain(self) -> tuple[WheelSample, ...]:
        """Return the wheel samples that have arrived since the last call, oldest first."""
        return self._encoders.delivery.drain(self._world.now_ns) if self._state is DeviceState.OPEN else ()

    def stop(self) -> None:
        """Brake to rest."""
        self._drive.stop()

    def close(self) -> None:
        """Brake to rest and deliver nothing more."""
        self.stop()
        self._state = DeviceState.CLOSED

    def health(self) -> DeviceHealth:
        """Say how it stands."""
        return DeviceHealth(
            device=self._setup.name,
            state=self._state,
            received=self._encoders.delivery.arrived,
            dropped=self._encoders.dropped,
            overflowed=self._encoders.delivery.overflowed,
            expired_commands=self._drive.expired,
            expected_period_ns=self._settings.encoders.period_ns,
        )

    def build(self, spec: Any, base: Any) -> None:
        """Add the chassis to the model."""
        self._chassis.build(spec, base)

    def bind(self, world: MujocoWorld) -> None:
        """Look up the chassis in the compiled model."""
        self._chassis.bind(world)

    def act(self, world: MujocoWorld) -> None:
        """Move the set point on, and measure the wheels when it is time."""
        self._chassis.drive(world, self._rates_from_twist.dot(self._noise.spoil(self._drive.step(world.now_ns))))
        if self._state is DeviceState.OPEN and self._encoders.due(world.now_ns):
            self._encoders.measure(world.now_ns, self._chassis.wheel_angles(world))

    def _reset(self) -> None:
        rng = stream(self._setup.seed, f"{self._setup.name}.encoders")
        self._encoders = WheelEncoders(self._settings.encoders, rng, self._kinematics.wheel_count, self._world.now_ns)
        actuation = stream(self._setup.seed, f"{self._setup.name}.actuation")
        self._noise = ActuationNoise(self._settings.actuation_noise, actuation, self._chassis.period_ns * 1e-9)
        self._drive.expired = 0


def _matrix_of(kinematics: WheelKinematics, limits: BaseLimits) -> NDArray[np.float64]:
    """Return the matrix from (vx, vy, wz) to wheel rates, shape (wheels, 3); without sideways motion its column is zero."""
    forwards = kinematics.wheel_rates(BodyTwist(vx=1.0))
    sideways = kinematics.wheel_rates(BodyTwist(vy=1.0)) if limits.holonomic else np.zeros_like(forwards)
    return np.stack((forwards, sideways, kinematics.wheel_rates(BodyTwist(wz=1.0))), axis=1)
