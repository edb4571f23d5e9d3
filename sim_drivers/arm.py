"""A simulated seven-joint arm with Franka's published kinematics, limits and identified inertias."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from drivers.interface.arm_motion import PANDA, TrajectoryFollower
from drivers.interface.commands import JointLimits, JointTrajectory
from drivers.interface.devices import DeviceHealth, DeviceSetup, DeviceState
from drivers.interface.errors import DeviceError
from drivers.interface.samples import JointSample, Stamp, frozen_array
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.arm_model import MODEL, ArmBuild, PandaJoints
from sim_drivers.delivery import Delivery
from sim_drivers.world import SECOND_NS, MujocoWorld, require_world


class ArmSettings(ArmBuild):
    """How the arm is built, and its wire.  Franka streams at 1 kHz; the loop is given every tenth sample."""

    rate_hz: float = Field(default=100.0, gt=0.0, le=1000.0, description="joint samples per second")
    latency_s: float = Field(default=0.001, ge=0.0, le=1.0, description="from measuring to our side")
    command_latency_s: float = Field(default=0.001, ge=0.0, le=1.0, description="from command() to the first set point")
    loss_probability: float = Field(default=0.0005, ge=0.0, le=1.0, description="chance that a sample is lost on the way")
    buffered_samples: int = Field(default=256, ge=1, le=100_000, description="samples that wait at most to be drained")


class SimArm:
    """A simulated seven-joint Franka arm: position servos with gravity compensation, fed at 1 kHz by a `TrajectoryFollower`."""

    Settings: ClassVar[type[Settings]] = ArmSettings
    role: ClassVar[str] = "arm"
    model: ClassVar[str] = MODEL
    max_step_s = 0.001
    period_ns = 1_000_000

    def __init__(self, settings: ArmSettings, setup: DeviceSetup) -> None:
        """Join the world.

        Raises:
            ConfigurationError: there is no simulated world.
        """
        self._settings = settings
        self._setup = setup
        self._state = DeviceState.CLOSED
        self._follower = TrajectoryFollower(PANDA, np.array(settings.start_rad))
        self._command_latency_ns = round(settings.command_latency_s * SECOND_NS)
        self._pending: list[tuple[int, JointTrajectory, int]] = []  # applies_ns, trajectory, expires_ns
        self._sample_period_ns = round(SECOND_NS / settings.rate_hz)
        self._joints = PandaJoints(settings, setup.name)
        self._world = require_world(setup)
        self._reset()
        self._world.add(self)

    @property
    def limits(self) -> JointLimits:
        """What it may be asked."""
        return PANDA

    def open(self) -> None:
        """Start delivering; counters and noise begin anew."""
        if self._state is not DeviceState.OPEN:
            self._reset()
            self._state = DeviceState.OPEN

    def command(self, trajectory: JointTrajectory, expires_ns: int) -> None:
        """Follow the trajectory until `expires_ns`, then decelerate to rest.

        Raises:
            DeviceError: it cannot be followed (not finite, out of range, too fast, wrong shape), or the arm is not open.
        """
        if fault := PANDA.fault_of(trajectory):
            raise DeviceError(f"{self._setup.name}: the trajectory {fault}")
        if self._state is not DeviceState.OPEN:
            raise DeviceError(f"{self._setup.name} is not open and takes no commands")
        self._pending.append((self._world.now_ns + self._command_latency_ns, trajectory, expires_ns))

    def drain(self) -> tuple[JointSample, ...]:
        """Return the joint samples that have arrived since the last call, oldest first."""
        return self._delivery.drain(self._world.now_ns) if self._state is DeviceState.OPEN else ()

    def stop(self) -> None:
        """Decelerate to rest."""
        self._pending.clear()
        self._follower.stop()

    def close(self) -> None:
        """Decelerate to rest and deliver nothing more."""
        self.stop()
        self._state = DeviceState.CLOSED

    def health(self) -> DeviceHealth:
        """Say how it stands."""
        return DeviceHealth(
            device=self._setup.name,
            state=self._state,
            received=self._delivery.arrived,
            dropped=self._dropped,
            overflowed=self._delivery.overflowed,
            expired_commands=self._follower.expired,
            expected_period_ns=self._sample_period_ns,
        )

    def build(self, spec: Any, base: Any) -> None:
        """Attach the model in `configs/models/panda.urdf` to the base, with a servo for each joint."""
        self._joints.attach(spec, base)

    def bind(self, world: MujocoWorld) -> None:
        """Look up the joints and put them where they start."""
        self._joints.bind(world)

    def act(self, world: MujocoWorld) -> None:
        """Move the set point on, and measure when it is time."""
        while self._pending and self._pending[0][0] <= world.now_ns:
            _, trajectory, expires_ns = self._pending.pop(0)
            self._follower.follow(trajectory, expires_ns)
        self._follower.step(world.now_ns)
        self._joints.drive(world, self._follower.position_rad, self._follower.velocity_rad_s)
        if self._state is DeviceState.OPEN and world.now_ns >= self._next_ns:
            self._measure(world)

    def _measure(self, world: MujocoWorld) -> None:
        now_ns = world.now_ns
        self._next_ns = self._after(now_ns)
        position, velocity, torque = self._joints.measure(world, self._rng)
        self._sequence += 1
        if self._rng.random() < self._settings.loss_probability:
            self._dropped += 1
            return
        stamp = Stamp(now_ns, now_ns + self._delivery.latency_ns, self._sequence)
        self._delivery.send(now_ns, JointSample(stamp, frozen_array(position), frozen_array(velocity), frozen_array(torque)))

    def _after(self, now_ns: int) -> int:
        return (now_ns // self._sample_period_ns + 1) * self._sample_period_ns

    def _reset(self) -> None:
        self._rng = stream(self._setup.seed, f"{self._setup.name}.joints")
        self._delivery: Delivery[JointSample] = Delivery(
            round(self._settings.latency_s * SECOND_NS), self._settings.buffered_samples
        )
        self._sequence = self._dropped = self._follower.expired = 0
        self._next_ns = self._after(self._world.now_ns)
