"""The camera of `trundle emulate`: frames from shared memory, pushed through librealsense's software device."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.camera_wire import DepthWire, MotionWire, attach, path_of
from drivers.interface.errors import DeviceError
from drivers.realsense.library import librealsense
from drivers.realsense.settings import CameraSettings, ImuSettings


class EmulatedSource:
    """A software device with the streams that are wanted."""

    is_over = False

    def __init__(self, device: str, memory: str, camera: CameraSettings | None, imu: ImuSettings | None) -> None:
        """Find the memory.

        Raises:
            DeviceError: no emulation has such a camera.
        """
        self._name = device
        try:
            depth = attach(DepthWire, path_of(memory, "depth")) if camera is not None else None
            motion = attach(MotionWire, path_of(memory, "motion")) if imu is not None else None
        except OSError as error:
            raise DeviceError(
                f"{device}: no emulation has a camera '{memory}' ({error.strerror or error}); "
                "start 'trundle emulate' with the same configuration"
            ) from error
        rs = librealsense()
        self._device = rs.software_device()
        for info, text in ((rs.camera_info.name, "emulated RealSense"), (rs.camera_info.serial_number, memory)):
            self._device.register_info(info, text)
        self._depth = _Depth(self._device, depth, camera.rate_hz) if camera is not None and depth is not None else None
        self._motion = _Motion(self._device, motion, imu.gyro_rate_hz) if imu is not None and motion is not None else None
        if self._depth is not None and self._motion is not None:
            alike = rs.extrinsics()
            alike.rotation, alike.translation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0]
            for profile in self._motion.profiles:
                profile.register_extrinsics_to(self._depth.profile, alike)

    @property
    def device(self) -> Any:
        """The software device."""
        return self._device

    def pump(self) -> None:
        """Push what has come.

        Raises:
            DeviceError: the camera was unplugged.
        """
        for part in (self._depth, self._motion):
            if part is None:
                continue
            if not part.wire.plugged[0]:
                raise DeviceError(f"{self._name}: the emulated camera was unplugged")
            part.pump()

    def close(self) -> None:
        """Do nothing more: the memory goes with its last user."""


class _Depth:
    """The stereo module."""

    def __init__(self, device: Any, wire: DepthWire, rate_hz: int) -> None:
        """Look through the lens that the other end tells of."""
        rs = librealsense()
        self.wire = wire
        lens = wire.lens
        k = lens.intrinsics
        stream = rs.video_stream()
        stream.type, stream.index, stream.uid, stream.fmt, stream.bpp = rs.stream.depth, 0, 1, rs.format.z16, 2
        stream.width, stream.height, stream.fps = k.width, k.height, rate_hz
        pinhole = rs.intrinsics()
        pinhole.width, pinhole.height, pinhole.model = k.width, k.height, rs.distortion.brown_conrady
        pinhole.fx, pinhole.fy, pinhole.ppx, pinhole.ppy = k.fx, k.fy, k.cx, k.cy
        stream.intrinsics = pinhole
        self._sensor = device.add_sensor("Stereo Module")
        self.profile = self._sensor.add_video_stream(stream, True)
        self._sensor.add_read_only_option(rs.option.depth_units, lens.depth_unit_m)
        self._sensor.add_read_only_option(rs.option.stereo_baseline, 95.0)
        self._unit_m = lens.depth_unit_m
        self._size = (k.height, k.width)

    def pump(self) -> None:
        """Push the newest image, enlarged to the size of the stream."""
        taken = self.wire.frames.take()
        if taken is None:
            return
        rs = librealsense()
        meta, pixels = taken
        number, device_us, width, height = meta.item()
        frame = rs.software_video_frame()
        frame.profile, frame.domain = self.profile.as_video_stream_profile(), rs.timestamp_domain.hardware_clock
        frame.frame_number, frame.timestamp, frame.depth_units = number, device_us * 1e-3, self._unit_m
        frame.bpp, frame.stride = 2, 2 * self._size[1]
        frame.pixels = enlarged(pixels.view(np.uint16).reshape(height, width), self._size)
        self._sensor.on_video_frame(frame)


class _Motion:
    """The motion module, its axes those of the depth stream."""

    def __init__(self, device: Any, wire: MotionWire, rate_hz: int) -> None:
        """Begin with what comes from now on."""
        rs = librealsense()
        self.wire = wire
        wire.samples.skip()
        self._sensor = device.add_sensor("Motion Module")
        self.profiles = []
        for uid, kind in ((2, rs.stream.gyro), (3, rs.stream.accel)):
            stream = rs.motion_stream()
            stream.type, stream.index, stream.uid, stream.fmt = kind, 0, uid, rs.format.motion_xyz32f
            stream.fps = rate_hz
            self.profiles.append(self._sensor.add_motion_stream(stream))

    def pump(self) -> None:
        """Push every sample as a rate and a force."""
        rs = librealsense()
        for number, device_us, *vectors in self.wire.samples.drain().tolist():
            for profile, (x, y, z) in zip(self.profiles, vectors, strict=True):
                data = rs.vector()
                data.x, data.y, data.z = x, y, z
                frame = rs.software_motion_frame()
                frame.profile, frame.domain = profile.as_motion_stream_profile(), rs.timestamp_domain.hardware_clock
                frame.frame_number, frame.timestamp, frame.data = number, device_us * 1e-3, data
                self._sensor.on_motion_frame(frame)


def enlarged(image: NDArray[np.uint16], size: tuple[int, int]) -> NDArray[np.uint16]:
    """Return an image whose pixels have become squares, cut to a size (height, width).

    >>> enlarged(np.array([[1, 2]], dtype=np.uint16), (2, 3)).tolist()
    [[1, 1, 2], [1, 1, 2]]
    """
    factor = -(-size[1] // image.shape[1])
    return np.ascontiguousarray(image.repeat(factor, axis=0).repeat(factor, axis=1)[: size[0], : size[1]])
