"""The inertial unit of an emulated RealSense."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from drivers.interface.camera_wire import MotionWire
from drivers.interface.geometry import BODY_FROM_OPTICAL, SE3
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.firmware.camera_faults import CameraFault, CameraFaults
from sim_drivers.firmware.camera_port import CameraPort, device_us
from sim_drivers.firmware.firmware import FirmwareSetup
from sim_drivers.imu import ImuSettings, SimImu
from sim_drivers.imu_noise import ImuNoiseSettings
from sim_drivers.world import MujocoWorld

SEND_NS = 2_500_000


class CameraImuSettings(Settings):
    """Its place in base, its errors and its clock."""

    x_m: float = Field(default=0.1, ge=-2.0, le=2.0, description="mount in base")
    y_m: float = Field(default=0.0, ge=-2.0, le=2.0, description="mount in base")
    z_m: float = Field(default=0.4, ge=0.0, le=3.0, description="mount above the floor")
    latency_s: float = Field(default=0.005, ge=0.0, le=1.0, description="from capture to the host")
    loss_probability: float = Field(default=0.0005, ge=0.0, le=1.0, description="of one sample")
    clock_offset_s: float = Field(default=1000.0, ge=0.0, le=4000.0, description="its clock, ahead of the host's")
    clock_drift: float = Field(default=30e-6, ge=-1e-3, le=1e-3, description="how much faster its clock runs, as a fraction")
    noise: ImuNoiseSettings = ImuNoiseSettings()
    faults: tuple[CameraFault, ...] = Field(default=(), description="misbehaviour, by script: disconnect and drop")


class RealSenseImuFirmware:
    """A simulated inertial unit whose samples go to shared memory, in the axes of the camera's optical frame."""

    Settings: ClassVar[type[Settings]] = CameraImuSettings
    max_step_s = 0.01
    period_ns = SEND_NS

    def __init__(self, driver_settings: Any, settings: CameraImuSettings, setup: FirmwareSetup) -> None:
        """Join the world; the driver's settings are those of `realsense_imu`."""
        d, s = driver_settings, settings
        self._settings = settings
        self._setup = setup
        mount = SE3.from_euler(0.0, 0.0, 0.0, d.roll_rad, d.pitch_rad, d.yaw_rad)
        self._optical_from_base = (mount @ BODY_FROM_OPTICAL).rotation.T
        inside = ImuSettings(rate_hz=d.gyro_rate_hz, **s.model_dump(exclude={"clock_offset_s", "clock_drift", "faults"}))
        self._imu = SimImu(inside, setup.device("imu"))
        self._port = CameraPort(MotionWire, d.memory, "motion", setup.name)
        self._faults = CameraFaults(settings.faults, stream(setup.seed, f"{setup.name}.faults"))
        self._opened = False
        setup.world.add(self)

    @property
    def listens(self) -> str:
        """The shared memory."""
        return f"shared memory {self._port.path}"

    def open(self) -> None:
        """Plug it in.

        Raises:
            DeviceError: another emulation has one of that name.
        """
        self._port.open()
        self._opened = True
        self._imu.open()

    def close(self) -> None:
        """Unplug it."""
        self._opened = False
        self._imu.close()
        self._port.close()

    def build(self, spec: Any, base: Any) -> None:
        """Add nothing: the unit inside does."""

    def bind(self, world: MujocoWorld) -> None:
        """Look up nothing."""

    def act(self, world: MujocoWorld) -> None:
        """Send what has been measured."""
        samples = self._imu.drain()
        if not self._opened:
            return
        if self._faults.active("disconnect", world.scene_ns):
            self._port.close()
            return
        wire = self._port.wire or self._port.open()
        s, shift_ns = self._settings, self._setup.host.now_ns - world.now_ns
        for sample in samples:
            if self._faults.hits("drop", world.scene_ns):
                continue
            stamp_us = device_us(sample.stamp.captured_ns + shift_ns, s.clock_offset_s, s.clock_drift)
            gyro, accel = (self._optical_from_base @ np.array(v) for v in (sample.gyro_rad_s, sample.accel_m_s2))
            wire.samples.put((sample.stamp.sequence, stamp_us, gyro, accel))
