"""A software device that turns arrays into frames."""

from typing import Any

import numpy as np

from drivers.realsense.library import librealsense

SHAPE = (480, 848)


class Imager:
    """One depth stream of 848x480."""

    def __init__(self) -> None:
        rs = self.rs = librealsense()
        stream = rs.video_stream()
        stream.type, stream.fmt, stream.bpp, stream.uid = rs.stream.depth, rs.format.z16, 2, 1
        stream.width, stream.height, stream.fps = SHAPE[1], SHAPE[0], 30
        pinhole = rs.intrinsics()
        pinhole.height, pinhole.width = SHAPE
        pinhole.fx, pinhole.fy, pinhole.ppx, pinhole.ppy = 434.0, 434.0, 424.0, 240.0
        stream.intrinsics = pinhole
        self.device = rs.software_device()
        self.sensor = self.device.add_sensor("Stereo Module")
        self.profile = self.sensor.add_video_stream(stream)
        self.sensor.add_read_only_option(rs.option.depth_units, 0.001)
        self.sensor.add_read_only_option(rs.option.stereo_baseline, 95.0)
        self.queue = rs.frame_queue(2)
        self.number = 0

    def start(self, sensor: Any = None) -> None:
        """Open the stream, of this device or of one that wraps it."""
        self._started = sensor or self.sensor
        self._started.open(self._started.get_stream_profiles())
        self._started.start(self.queue)

    def frame(self, depth: np.ndarray) -> Any:
        self.number += 1
        frame = self.rs.software_video_frame()
        frame.profile = self.profile.as_video_stream_profile()
        frame.frame_number, frame.timestamp = self.number, 33.0 * self.number
        frame.domain = self.rs.timestamp_domain.hardware_clock
        frame.bpp, frame.stride, frame.depth_units, frame.pixels = 2, 2 * SHAPE[1], 0.001, depth
        self.sensor.on_video_frame(frame)
        return self.queue.wait_for_frame()

    def close(self) -> None:
        self._started.stop()
        self._started.close()
