"""Which of a camera's stream profiles are opened."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from drivers.interface.errors import DeviceError
from drivers.realsense.library import librealsense
from drivers.realsense.plan import CameraPlan

COLOUR_SIZE = (640, 480)


@dataclass(frozen=True, slots=True)
class Offer:
    """A profile, and the sensor that has it."""

    sensor: Any
    profile: Any

    @property
    def rate_hz(self) -> int:
        """Frames a second."""
        return int(self.profile.fps())

    @property
    def size(self) -> tuple[int, int]:
        """Width and height [pixels]."""
        video = self.profile.as_video_stream_profile()
        return video.width(), video.height()


@dataclass(frozen=True, slots=True)
class Choice:
    """What is opened; None: not wanted."""

    depth: Offer | None
    colour: Offer | None
    gyro: Offer | None
    accel: Offer | None

    @property
    def offers(self) -> tuple[Offer, ...]:
        """All that is opened."""
        return tuple(offer for offer in (self.depth, self.colour, self.gyro, self.accel) if offer is not None)


def choose(device: Any, plan: CameraPlan, name: str) -> Choice:
    """Choose among what a device offers; of a recording or an emulated one, the depth that there is.

    Raises:
        DeviceError: it does not have what is wanted; says what it has.
    """
    rs, camera, imu = librealsense(), plan.camera, plan.imu
    depth = colour = gyro = accel = None
    if camera is not None:
        offers = tuple(_offers(device, rs.stream.depth, rs.format.z16))
        if plan.source.source == "live":
            wanted = (camera.width, camera.height), camera.rate_hz
            fitting = tuple(offer for offer in offers if (offer.size, offer.rate_hz) == wanted)
        else:
            fitting = offers
        if not fitting:
            have = ", ".join(sorted({f"{o.size[0]}x{o.size[1]} at {o.rate_hz} Hz" for o in offers})) or "no depth at all"
            mode = f"{camera.width}x{camera.height} at {camera.rate_hz} Hz"
            raise DeviceError(f"{name}: it has no depth of {mode} over this connection; it has {have}")
        depth = fitting[0]
        if camera.colour_rate_hz > 0.0:
            colour = _colour(tuple(_offers(device, rs.stream.color, rs.format.rgb8)), camera.colour_rate_hz, name)
    if imu is not None:
        gyro = _nearest(tuple(_offers(device, rs.stream.gyro, rs.format.motion_xyz32f)), imu.gyro_rate_hz, name, "gyroscope")
        accel = _nearest(
            tuple(_offers(device, rs.stream.accel, rs.format.motion_xyz32f)), imu.accel_rate_hz, name, "accelerometer"
        )
    return Choice(depth, colour, gyro, accel)


def _offers(device: Any, kind: Any, form: Any) -> Iterator[Offer]:
    for sensor in device.query_sensors():
        for profile in sensor.get_stream_profiles():
            if profile.stream_type() == kind and profile.format() == form:
                yield Offer(sensor, profile)


def _nearest(offers: tuple[Offer, ...], rate_hz: float, name: str, part: str) -> Offer:
    if not offers:
        raise DeviceError(f"{name}: this camera has no {part}")
    return min(offers, key=lambda offer: abs(offer.rate_hz - rate_hz))


def _colour(offers: tuple[Offer, ...], rate_hz: float, name: str) -> Offer:
    """Return the slowest that is fast enough, at about a size that is enough to look at."""

    def unsuitable(offer: Offer) -> tuple[bool, int, int]:
        (width, height), (good_width, good_height) = offer.size, COLOUR_SIZE
        return offer.rate_hz < rate_hz, offer.rate_hz, abs(width - good_width) + abs(height - good_height)

    if not offers:
        raise DeviceError(f"{name}: this camera has no colour; set colour_rate_hz to 0")
    return min(offers, key=unsuitable)
