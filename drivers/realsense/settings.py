"""Which camera it is, which of its streams are read, how they are filtered, and where it sits."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal, Self

from pydantic import Field, model_validator

from drivers.interface.settings import Settings
from drivers.realsense.filters import FilterSettings


class SourceSettings(Settings):
    """Where frames come from; devices with the same source share one process."""

    source: Literal["live", "bag", "emulated"] = Field(default="live", description="a camera, a recording, `trundle emulate`")
    serial_number: str = Field(default="", max_length=32, description="live: of the camera; empty: the only one there is")
    path: Path | None = Field(default=None, description="bag: the recording, .bag or .db3")
    memory: str = Field(default="camera", pattern=r"^[A-Za-z0-9_-]{1,40}$", description="emulated: name of the shared memory")
    connect_s: float = Field(default=5.0, gt=0.1, le=60.0, description="until the first frame must have come")
    silent_s: float = Field(default=0.5, gt=0.05, le=10.0, description="without a frame for so long the camera is lost")
    latency_s: float = Field(default=0.03, ge=0.0, le=0.5, description="from capture to the arrival of the fastest frames")
    x_m: float = Field(default=0.1, ge=-2.0, le=2.0, description="mount of the camera's body (x forward, y left, z up) in base")
    y_m: float = Field(default=0.0, ge=-2.0, le=2.0, description="mount in base")
    z_m: float = Field(default=0.4, ge=0.0, le=3.0, description="mount above the floor")
    roll_rad: float = Field(default=0.0, ge=-math.pi, le=math.pi, description="mount about x")
    pitch_rad: float = Field(default=0.0, ge=-math.pi / 2, le=math.pi / 2, description="mount about y; positive looks down")
    yaw_rad: float = Field(default=0.0, ge=-math.pi, le=math.pi, description="mount about z")

    @model_validator(mode="after")
    def _has_a_path(self) -> Self:
        if (self.source == "bag") != (self.path is not None):
            raise ValueError("path: names the recording when source is 'bag', and only then")
        return self

    @property
    def place(self) -> str:
        """The source in a few words; equal for devices of one camera."""
        match self.source:
            case "bag":
                return f"recording {self.path}"
            case "emulated":
                return f"emulated camera '{self.memory}'"
        return f"camera {self.serial_number or '(any)'}"


class CameraSettings(SourceSettings):
    """The depth stream (of a recording: whatever it holds), and a colour picture now and then for the human eye."""

    width: int = Field(default=848, ge=64, le=1280, description="of the depth stream, pixels before decimation")
    height: int = Field(default=480, ge=36, le=720, description="of the depth stream, pixels before decimation")
    rate_hz: int = Field(default=30, ge=5, le=100, description="of the depth stream: D455: 5, 15, 30, 60 or 90")
    filters: FilterSettings = FilterSettings()
    colour_rate_hz: float = Field(default=0.0, ge=0.0, le=10.0, description="JPEG pictures a second, for the log; 0: none")
    jpeg_quality: int = Field(default=70, ge=1, le=100, description="of the pictures")


class ImuSettings(SourceSettings):
    """The camera's accelerometer and gyroscope; the mount is the camera's."""

    latency_s: float = Field(default=0.005, ge=0.0, le=0.5, description="from capture to the arrival of the fastest samples")
    gyro_rate_hz: int = Field(default=200, ge=50, le=1000, description="D455: 200 or 400; the nearest that it offers is taken")
    accel_rate_hz: int = Field(default=200, ge=50, le=1000, description="D455: 100, 200 or 400 (older: 63 or 250), likewise")
