"""What the process at the camera is told, and how its memory is laid out."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np

from drivers.io.channels import FrameSpec, MemorySpec, RingSpec
from drivers.realsense.settings import CameraSettings, ImuSettings, SourceSettings

LARGEST_DEPTH = 2 * 1280 * 720  # bytes
LARGEST_PICTURE = 1_000_000
DOMAINS = ("hardware_clock", "system_time", "global_time")  # of a frame's own stamp, by librealsense's numbers
STAMP = [("captured_ns", "i8"), ("received_ns", "i8"), ("sequence", "i8"), ("domain", "i8")]
DEPTH = np.dtype([*STAMP, ("width", "i4"), ("height", "i4"), *((name, "f8") for name in ("fx", "fy", "cx", "cy", "unit_m"))])
PICTURE = np.dtype(STAMP)
MOTION = np.dtype([*STAMP, ("gyro_rad_s", "f8", (3,)), ("accel_m_s2", "f8", (3,))])  # in the depth stream's optical frame
MEMORY = MemorySpec(
    rings=(RingSpec("motion", MOTION, 1024),),
    frames=(FrameSpec("depth", DEPTH, LARGEST_DEPTH), FrameSpec("colour", PICTURE, LARGEST_PICTURE)),
)


class Figure(enum.IntEnum):
    """What else the process says of itself, by its place in `HealthRecord.figures`."""

    DEPTH_DROPPED = 0  # lost on the way by the frame counter, came twice, or could not be used
    MOTION_DROPPED = 1
    CLOCK_DRIFT = 2  # how much slower the camera's clock runs than ours, as a fraction


@dataclass(frozen=True, slots=True)
class CameraPlan:
    """Which source, and what each device wants of it."""

    source: SourceSettings
    camera: CameraSettings | None = None
    imu: ImuSettings | None = None
