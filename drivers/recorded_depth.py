"""A folder of depth images, played through the camera contract as if they came now."""

from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.devices import DeviceHealth, DeviceSetup, DeviceState
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import BODY_FROM_OPTICAL, SE3
from drivers.interface.samples import DepthFrame, Intrinsics, Stamp, frozen_array
from drivers.interface.settings import Settings


class RecordedDepthSettings(Settings):
    """Where the images are, how fast they were taken, and the camera that took them."""

    path: Path = Field(description="folder of single-channel 16-bit PNG files, played in the order of their names")
    rate_hz: float = Field(30.0, gt=0.0, le=1000.0, description="frames per second of the recording")
    depth_unit_m: float = Field(0.001, gt=0.0, le=1.0, description="metres per count of depth")
    fx_px: float = Field(gt=0.0, le=1e5, description="focal length along the image's rows")
    fy_px: float = Field(gt=0.0, le=1e5, description="focal length along the image's columns")
    cx_px: float = Field(ge=0.0, le=1e5, description="principal point, column")
    cy_px: float = Field(ge=0.0, le=1e5, description="principal point, row")
    x_m: float = Field(0.0, ge=-10.0, le=10.0, description="where the camera sits in the base, forward")
    y_m: float = Field(0.0, ge=-10.0, le=10.0, description="where the camera sits in the base, left")
    z_m: float = Field(0.0, ge=-10.0, le=10.0, description="where the camera sits in the base, up")
    roll_rad: float = Field(0.0, ge=-3.2, le=3.2, description="turn of the camera's body about x forward")
    pitch_rad: float = Field(0.0, ge=-3.2, le=3.2, description="turn of the camera's body about y left; positive looks down")
    yaw_rad: float = Field(0.0, ge=-3.2, le=3.2, description="turn of the camera's body about z up")
    loop: bool = Field(False, description="begin again after the last frame")


class RecordedDepthCamera:
    """Plays a folder of depth images as a camera.

    Frame k is played as captured at `open + k / rate_hz`; what fell due unread between two calls of `latest` is dropped.

    A file is decoded when its frame is asked for; one that cannot be decoded is dropped too.
    """

    Settings: ClassVar[type[Settings]] = RecordedDepthSettings
    role: ClassVar[str] = "camera"

    def __init__(self, settings: RecordedDepthSettings, setup: DeviceSetup) -> None:
        """Remember; touch nothing."""
        self._settings = settings
        self._setup = setup
        self._period_ns = round(1e9 / settings.rate_hz)
        camera = SE3.from_euler(settings.x_m, settings.y_m, settings.z_m, settings.roll_rad, settings.pitch_rad, settings.yaw_rad)
        self._base_from_optical = camera @ BODY_FROM_OPTICAL
        self._files: Sequence[Path] = ()
        self._open_ns: int | None = None
        self._next = 0  # the first frame not yet played or dropped
        self._received = self._dropped = 0

    def open(self) -> None:
        """List the images and start the recording's time.

        Raises:
            ConfigurationError: the folder does not exist, or holds no PNG file, or its first one is no depth image.
        """
        folder = self._settings.path
        if not folder.is_dir():
            raise ConfigurationError(f"{self._setup.name}.path: there is no folder '{folder}' of depth images")
        self._files = sorted(folder.glob("*.png"))
        if not self._files:
            raise ConfigurationError(f"{self._setup.name}.path: the folder '{folder}' holds no .png file")
        if _decoded(self._files[0]) is None:
            raise ConfigurationError(f"{self._setup.name}.path: '{self._files[0]}' is not a single-channel 16-bit PNG image")
        self._next = self._received = self._dropped = 0
        self._open_ns = self._setup.now_ns()

    def stop(self) -> None:
        """Do nothing: a camera does not move."""

    def close(self) -> None:
        """End the recording's time."""
        self._open_ns = None

    def latest(self) -> DepthFrame | None:
        """Return the newest frame that is due and was not yet returned, or None."""
        now_ns, open_ns = self._setup.now_ns(), self._open_ns
        index = self._newest_due(now_ns)
        if open_ns is None or index < self._next:
            return None
        self._dropped += index - self._next
        self._next = index + 1
        depth = _decoded(self._files[index % len(self._files)])
        if depth is None:
            self._dropped += 1
            return None
        self._received += 1
        stamp = Stamp(open_ns + index * self._period_ns, now_ns, index)
        return self._frame(depth, stamp)

    def health(self) -> DeviceHealth:
        """Say how it stands; the recording has ended one period after its last frame fell due."""
        return DeviceHealth(
            self._setup.name,
            self._state(),
            received=self._received,
            dropped=self._dropped,
            expected_period_ns=self._period_ns,
        )

    def _newest_due(self, now_ns: int) -> int:
        if self._open_ns is None:
            return -1
        due = (now_ns - self._open_ns) // self._period_ns
        return due if self._settings.loop else min(due, len(self._files) - 1)

    def _state(self) -> DeviceState:
        if self._open_ns is None:
            return DeviceState.CLOSED
        end_ns = self._open_ns + len(self._files) * self._period_ns
        ended = not self._settings.loop and self._setup.now_ns() >= end_ns
        return DeviceState.ENDED if ended else DeviceState.OPEN

    def _frame(self, depth: NDArray[np.uint16], stamp: Stamp) -> DepthFrame:
        s = self._settings
        height, width = depth.shape
        intrinsics = Intrinsics(width, height, s.fx_px, s.fy_px, s.cx_px, s.cy_px)
        return DepthFrame(stamp, frozen_array(depth), s.depth_unit_m, intrinsics, self._base_from_optical)


def _decoded(path: Path) -> NDArray[np.uint16] | None:
    """Return the depth image, shape (height, width), or None when the file is missing, cut or of another kind."""
    try:
        data = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    except OSError:
        return None
    image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if data.size else None
    if image is None or image.ndim != 2 or image.dtype != np.uint16:
        return None
    return np.ascontiguousarray(image, dtype=np.uint16)
