"""The depth of an emulated RealSense, cast at the size that the driver's decimation will leave."""

from __future__ import annotations

from collections import deque
from typing import Any, ClassVar, Protocol

from pydantic import Field

from drivers.interface.camera_wire import DepthWire, Lens
from drivers.interface.samples import DepthFrame, Intrinsics
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.depth_camera import DepthCameraSettings, SimDepthCamera, intrinsics
from sim_drivers.depth_noise import DepthNoiseSettings
from sim_drivers.firmware.camera_faults import CameraFault, CameraFaults
from sim_drivers.firmware.camera_port import CameraPort, device_us
from sim_drivers.firmware.firmware import FirmwareSetup
from sim_drivers.world import SECOND_NS, MujocoWorld

SEND_NS = 2_500_000


class Filters(Protocol):
    """How the driver filters."""

    @property
    def decimation(self) -> int:
        """Pixels along each side that become one."""
        ...


class CameraWire(Protocol):
    """What both ends must agree on: the settings of the `realsense` driver."""

    @property
    def memory(self) -> str:
        """Name of the shared memory."""
        ...

    @property
    def width(self) -> int:
        """Of the stream [pixels]."""
        ...

    @property
    def height(self) -> int:
        """Of the stream [pixels]."""
        ...

    @property
    def rate_hz(self) -> int:
        """Of the stream."""
        ...

    @property
    def filters(self) -> Filters:
        """How the driver filters."""
        ...


class CameraFirmwareSettings(Settings):
    """What the camera makes of what is there; its mount is where the driver believes it."""

    min_range_m: float = Field(default=0.4, ge=0.0, le=2.0, description="nothing nearer is reported")
    range_max_m: float = Field(default=6.0, gt=0.0, le=20.0, description="nothing farther is reported")
    depth_unit_m: float = Field(default=0.001, ge=1e-4, le=0.01, description="of one count of depth")
    latency_s: float = Field(default=0.03, ge=0.0, le=0.5, description="from capture to the host")
    loss_probability: float = Field(default=0.002, ge=0.0, le=1.0, description="of a whole frame")
    sees_robot: bool = Field(default=False, description="whether the robot's own body is in the picture")
    clock_offset_s: float = Field(default=1000.0, ge=0.0, le=4000.0, description="its clock, ahead of the host's")
    clock_drift: float = Field(default=30e-6, ge=-1e-3, le=1e-3, description="how much faster its clock runs, as a fraction")
    noise: DepthNoiseSettings = DepthNoiseSettings()
    faults: tuple[CameraFault, ...] = Field(default=(), description="misbehaviour, by script")


class RealSenseFirmware:
    """A simulated camera whose frames go to shared memory, stamped by a clock of its own."""

    Settings: ClassVar[type[Settings]] = CameraFirmwareSettings
    max_step_s = 0.01
    period_ns = SEND_NS

    def __init__(self, driver_settings: Any, settings: CameraFirmwareSettings, setup: FirmwareSetup) -> None:
        """Join the world."""
        wire: CameraWire = driver_settings
        self._settings = settings
        self._setup = setup
        self._stream = intrinsics(wire.width, wire.height)
        self._camera = _camera(driver_settings, settings, setup, decimated(self._stream, wire.filters.decimation))
        self._port = CameraPort(DepthWire, wire.memory, "depth", setup.name)
        self._faults = CameraFaults(settings.faults, stream(setup.seed, f"{setup.name}.faults"))
        self._waiting: deque[tuple[int, DepthFrame, int]] = deque()  # when it is due, the frame, its stamp by the camera's clock
        self._frozen: tuple[DepthFrame, int] | None = None
        self._opened = False
        setup.world.add(self)

    @property
    def listens(self) -> str:
        """The shared memory."""
        k = self._stream
        return f"shared memory {self._port.path}, depth {k.width}x{k.height}"

    def open(self) -> None:
        """Plug the camera in.

        Raises:
            DeviceError: another emulation has one of that name.
        """
        self._plug()
        self._opened = True
        self._camera.open()

    def close(self) -> None:
        """Unplug it."""
        self._opened = False
        self._camera.close()
        self._port.close()

    def build(self, spec: Any, base: Any) -> None:
        """Add nothing: the camera looks."""

    def bind(self, world: MujocoWorld) -> None:
        """Look up nothing."""

    def act(self, world: MujocoWorld) -> None:
        """Send what is due, as the script has it."""
        for frame in self._camera.drain():
            self._waiting.append(self._due(frame, world))
        if not self._opened:
            return
        if self._faults.active("disconnect", world.scene_ns):
            self._port.close()
        elif self._port.wire is None:
            self._plug()
        while self._waiting and self._waiting[0][0] <= world.now_ns:
            _, frame, stamp_us = self._waiting.popleft()
            self._send(frame, stamp_us, world.scene_ns)

    def _plug(self) -> None:
        self._port.open().lens = Lens(self._stream, self._settings.depth_unit_m)

    def _due(self, frame: DepthFrame, world: MujocoWorld) -> tuple[int, DepthFrame, int]:
        s, scene_ns = self._settings, world.scene_ns
        captured_ns = frame.stamp.captured_ns + self._setup.host.now_ns - world.now_ns
        ahead_s = s.clock_offset_s + self._faults.shift_ns("clock_jump", scene_ns) / SECOND_NS
        return world.now_ns + self._faults.shift_ns("delay", scene_ns), frame, device_us(captured_ns, ahead_s, s.clock_drift)

    def _send(self, frame: DepthFrame, stamp_us: int, scene_ns: int) -> None:
        if self._faults.hits("drop", scene_ns):
            return
        if not self._faults.active("freeze", scene_ns) or self._frozen is None:
            self._frozen = frame, stamp_us
        shown, shown_us = self._frozen
        wire = self._port.wire
        if wire is not None:
            wire.put(shown.stamp.sequence, shown_us, shown.depth)


def decimated(stream: Intrinsics, factor: int) -> Intrinsics:
    """Return what an image sees whose pixels are squares of so many of the stream's; those at its far edges may reach beyond.

    >>> decimated(Intrinsics(848, 480, 434.27, 434.27, 431.77, 240.45), 3).width
    283
    """
    cx, cy = (stream.cx + 0.5) / factor - 0.5, (stream.cy + 0.5) / factor - 0.5
    return Intrinsics(-(-stream.width // factor), -(-stream.height // factor), stream.fx / factor, stream.fy / factor, cx, cy)


def _camera(driver: Any, settings: CameraFirmwareSettings, setup: FirmwareSetup, lens: Intrinsics) -> SimDepthCamera:
    mount = {key: getattr(driver, key) for key in ("x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad")}
    own = settings.model_dump(exclude={"clock_offset_s", "clock_drift", "faults"})
    inside = DepthCameraSettings(width=lens.width, height=lens.height, rate_hz=driver.rate_hz, **mount, **own)
    return SimDepthCamera(inside, setup.device("depth"), lens)
