"""A simulated inertial measurement unit: the one inside a D455."""

from __future__ import annotations

from typing import Any, ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.devices import DeviceSetup
from drivers.interface.kernel import kernel
from drivers.interface.samples import ImuSample, Stamp
from drivers.interface.settings import Settings
from sim_drivers.imu_noise import ImuNoise, ImuNoiseSettings
from sim_drivers.sensor import SimSensor
from sim_drivers.world import SECOND_NS, MujocoWorld

F64 = NDArray[np.float64]


class ImuSettings(Settings):
    """Settings of the simulated IMU; its samples are turned into base, but are those of the place where it is mounted."""

    rate_hz: float = Field(default=200.0, gt=0.0, le=1000.0, description="D455: 200 or 400 Hz (gyro)")
    latency_s: float = Field(default=0.005, ge=0.0, le=1.0, description="from capture to the host")
    loss_probability: float = Field(default=0.0005, ge=0.0, le=1.0, description="of one sample")
    buffered_samples: int = Field(default=400, ge=1, le=100_000, description="how many wait for the loop")
    x_m: float = Field(default=0.1, ge=-2.0, le=2.0, description="mount in base")
    y_m: float = Field(default=0.0, ge=-2.0, le=2.0, description="mount in base")
    z_m: float = Field(default=0.4, ge=0.0, le=3.0, description="mount above the floor")
    noise: ImuNoiseSettings = ImuNoiseSettings()


class SimImu(SimSensor[ImuSample]):
    """A D455's IMU (Bosch BMI055) in the simulated world: noise, wandering bias, resolution, latency.

    Specific force is the change of velocity between two samples, not MuJoCo's momentary acceleration: contact impulses then
    count with what they do to the motion, as behind a real unit's anti-alias filter, and a base that is moved by setting its
    velocity feels right too.
    """

    Settings: ClassVar[type[Settings]] = ImuSettings
    role: ClassVar[str] = "imu"

    def __init__(self, settings: ImuSettings, setup: DeviceSetup) -> None:
        """Register with the world.

        Raises:
            ConfigurationError: there is no simulated world.
        """
        self._settings = settings
        super().__init__(setup, settings.rate_hz, settings.latency_s, settings.loss_probability, settings.buffered_samples)
        self._site_id = 0
        self._map_from_base, self._gravity_m_s2 = np.zeros(9), np.zeros(3)  # the former the compiled world's own
        self._velocity = np.zeros(6)  # of the site: angular, linear, along the map's axes
        self._acceleration = np.zeros(3)
        self._acted_ns = -1

    @property
    def place_in_base_m(self) -> tuple[float, float]:
        """Where it sits [m]."""
        return self._settings.x_m, self._settings.y_m

    def build(self, spec: Any, base: Any) -> None:
        """Mark its place on the base."""
        base.add_site(name=f"{self._setup.name}_imu", pos=[self._settings.x_m, self._settings.y_m, self._settings.z_m])

    def bind(self, world: MujocoWorld) -> None:
        """Find the site."""
        self._site_id = world.model.site(f"{self._setup.name}_imu").id
        self._map_from_base, self._gravity_m_s2 = world.data.site_xmat[self._site_id], world.model.opt.gravity.copy()
        _felt(self._map_from_base, self._velocity, self._acceleration, self._gravity_m_s2)

    def act(self, world: MujocoWorld) -> None:
        """Follow the velocity, also while closed, so that the first sample after opening is right."""
        before = self._velocity.copy()
        mujoco.mj_objectVelocity(world.model, world.data, mujoco.mjtObj.mjOBJ_SITE, self._site_id, self._velocity, 0)
        if self._acted_ns >= 0:
            self._acceleration = (self._velocity[3:] - before[3:]) / ((world.now_ns - self._acted_ns) / SECOND_NS)
        self._acted_ns = world.now_ns
        super().act(world)

    def _measure(self, world: MujocoWorld, stamp: Stamp) -> ImuSample:
        truth = _felt(self._map_from_base, self._velocity, self._acceleration, self._gravity_m_s2)
        gx, gy, gz, ax, ay, az = self._noise.spoil(truth, stamp.sequence).tolist()
        return ImuSample(stamp, (gx, gy, gz), (ax, ay, az))

    def _reset(self) -> None:
        super()._reset()
        self._noise = ImuNoise(self._settings.noise, self._settings.rate_hz, self._setup.seed, self._setup.name)


@kernel()
def _felt(map_from_base: F64, velocity: F64, acceleration: F64, gravity: F64) -> F64:
    """Return rates [rad/s] and specific force [m/s^2] along the base's axes, shape (6,).

    Args:
        map_from_base: rotation, row by row, shape (9,).
        velocity: angular and linear, along the map's axes, shape (6,).
        acceleration: along the map's axes, shape (3,) [m/s^2].
        gravity: the same, shape (3,) [m/s^2].
    """
    felt = np.zeros(6)
    for axis in range(3):
        for k in range(3):
            felt[axis] += map_from_base[3 * k + axis] * velocity[k]
            felt[3 + axis] += map_from_base[3 * k + axis] * (acceleration[k] - gravity[k])
    return felt
