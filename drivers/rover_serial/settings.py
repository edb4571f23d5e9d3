"""How the rover is built, where its autopilot is, and what is asked of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.kinematics import SkidSteer
from drivers.interface.settings import Settings
from drivers.rover_serial.place import FORMS, Place

Sign = Literal[-1, 1]
WheelIndex = Annotated[int, Field(ge=0, le=15)]
SystemId = Annotated[int, Field(ge=1, le=255)]
URL = Field(default="serial:/dev/ttyACM0:115200", description=f"where the autopilot is: {FORMS}")


class RoverSettings(Settings):
    """Everything about the base.  Geometry and caps default to the Jackal's, as the simulated one has them."""

    url: str = URL
    autopilot: Literal["auto", "ardupilot", "px4"] = Field(default="auto", description="auto: as its heartbeat says")
    system_id: SystemId = Field(default=1, description="MAVLink system id of the rover; all others are ignored")
    own_system_id: SystemId = Field(default=255, description="ours; the one whose heartbeats the autopilot's failsafe watches")
    own_component_id: SystemId = Field(default=191, description="ours; 191 is an onboard computer")
    signing_key: Path | None = Field(default=None, description="file with the signing key; none: nothing is signed")
    odometry: Literal["auto", "wheels", "position"] = Field(
        default="auto",
        description="WHEEL_DISTANCE, or LOCAL_POSITION_NED with ATTITUDE; auto: whichever the autopilot sends",
    )
    wheel_rates: Literal["distance", "rpm"] = Field(default="distance", description="rates by difference, or from RPM 1 and 2")
    rate_hz: float = Field(default=25.0, gt=0.5, le=200.0, description="of odometry; halved until the autopilot accepts it")
    status_rate_hz: float = Field(default=2.0, gt=0.1, le=50.0, description="of system status and battery")
    heartbeat_rate_hz: float = Field(default=5.0, ge=1.0, le=50.0, description="asked of the autopilot")
    latency_s: float = Field(default=0.01, ge=0.0, le=1.0, description="age of a sample while its clock is not known")
    connect_s: float = Field(default=10.0, gt=0.5, le=120.0, description="until the autopilot must have answered everything")
    ready_s: float = Field(default=60.0, ge=0.0, le=600.0, description="until its pre-arm checks must have passed, after that")
    arm_s: float = Field(default=5.0, gt=0.1, le=120.0, description="for how long arming is tried again after a refusal")
    silent_s: float = Field(default=1.0, gt=0.05, le=30.0, description="without odometry for so long the wire is lost")
    brake_s: float = Field(default=2.0, ge=0.1, le=30.0, description="for how long zero is repeated before it is disarmed")
    gather_s: float = Field(default=0.01, ge=0.0, le=0.05, description="bytes that come so close together are read together")
    heading_gain_per_s: float = Field(default=5.0, gt=0.1, le=50.0, description="PX4 only: its RO_YAW_P")

    wheel_radius_m: float = Field(default=0.098, gt=0.01, le=1.0, description="of every wheel")
    effective_track_m: float = Field(default=0.56, gt=0.05, le=5.0, description="between the sides, as the slip makes it")
    wheel_order: tuple[WheelIndex, WheelIndex] = Field(default=(0, 1), description="places of left and right in WHEEL_DISTANCE")
    wheel_signs: tuple[Sign, Sign] = Field(default=(1, 1), description="-1: that encoder counts the other way round")
    gear_ratio: float = Field(default=1.0, gt=0.01, le=500.0, description="turns that RPM counts for one of the wheel")
    position_std_m: float = Field(default=0.3, gt=0.0, le=50.0, description="of the autopilot's local position")
    yaw_std_rad: float = Field(default=0.05, gt=0.0, le=3.0, description="of its attitude")
    max_vx_m_s: float = Field(default=1.0, gt=0.0, le=5.0, description="cap forwards and backwards")
    max_wz_rad_s: float = Field(default=2.0, gt=0.0, le=10.0, description="cap on turning")
    reverse: bool = Field(default=True, description="whether it may drive backwards; PX4 cannot")
    acceleration_m_s2: float = Field(default=1.5, gt=0.0, le=20.0, description="cap on speeding up")
    angular_acceleration_rad_s2: float = Field(default=3.0, gt=0.0, le=50.0, description="cap on turning up")
    jerk_m_s3: float = Field(default=15.0, gt=0.0, le=1000.0, description="cap on jerk that a planner must keep")
    angular_jerk_rad_s3: float = Field(default=30.0, gt=0.0, le=1000.0, description="the same for turning")
    stop_deceleration_m_s2: float = Field(default=2.0, gt=0.0, le=20.0, description="how hard it brakes")
    stop_angular_deceleration_rad_s2: float = Field(default=6.0, gt=0.0, le=50.0, description="how hard it stops turning")

    @field_validator("url")
    @classmethod
    def _is_a_place(cls, url: str) -> str:
        Place.parse(url)
        return url

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if self.autopilot == "px4" and self.reverse:
            raise ValueError("reverse: must be false with PX4, which turns round to where a velocity points")
        if self.wheel_order[0] == self.wheel_order[1]:
            raise ValueError(f"wheel_order: left and right need places of their own, not {self.wheel_order}")
        if self.own_system_id == self.system_id:
            raise ValueError(f"own_system_id: {self.own_system_id} is the rover's")
        return self

    @property
    def place(self) -> Place:
        """The URL, parsed."""
        return Place.parse(self.url)

    @property
    def nominal(self) -> SkidSteer:
        """The geometry; one wheel stands for each side."""
        return SkidSteer(self.wheel_radius_m, self.effective_track_m, wheel_count=2)

    @property
    def fastest_m_s(self) -> float:
        """How fast a side goes at the caps together; nothing twice as fast is believed."""
        return self.max_vx_m_s + 0.5 * self.effective_track_m * self.max_wz_rad_s

    @property
    def limits(self) -> BaseLimits:
        """What the base may be asked."""
        return BaseLimits(
            velocity=BodyTwist(self.max_vx_m_s, 0.0, self.max_wz_rad_s),
            acceleration=BodyTwist(self.acceleration_m_s2, 0.0, self.angular_acceleration_rad_s2),
            jerk=BodyTwist(self.jerk_m_s3, 0.0, self.angular_jerk_rad_s3),
            stop_deceleration=BodyTwist(self.stop_deceleration_m_s2, 0.0, self.stop_angular_deceleration_rad_s2),
            reverse=self.reverse,
        )


class RoverImuSettings(Settings):
    """The unit inside the autopilot; its wire is the base's."""

    url: str = URL
    rate_hz: float = Field(default=25.0, gt=0.5, le=200.0, description="halved until the autopilot accepts it")
    message: Literal["auto", "RAW_IMU", "SCALED_IMU", "HIGHRES_IMU"] = Field(
        default="auto", description="auto: RAW_IMU (ArduPilot, which scales it) or HIGHRES_IMU (PX4)"
    )

    @field_validator("url")
    @classmethod
    def _is_a_place(cls, url: str) -> str:
        Place.parse(url)
        return url


@dataclass(frozen=True, slots=True)
class LinkSettings:
    """What the process at the wire is told."""

    name: str  # of the device in the robot
    base: RoverSettings
    imu: RoverImuSettings | None
    key: bytes | None
