"""How the rover and its autopilot were built and set up; the parameters carry the autopilot's own names in their descriptions."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from drivers.interface.settings import Settings
from sim_drivers.drive import DriveSettings
from sim_drivers.firmware.rover_faults import LinkFault
from sim_drivers.imu_noise import ImuNoiseSettings
from sim_drivers.skid_steer_base import Fraction
from sim_drivers.wheel_encoders import EncoderSettings

Text = Annotated[str, Field(max_length=200)]


class RoverAutopilotSettings(Settings):
    """All of it."""

    kind: Literal["ardupilot", "px4"] = Field(default="ardupilot", description="whose behaviour it has")
    firmware_version: tuple[int, int, int] = Field(default=(4, 8, 0), description="as AUTOPILOT_VERSION tells it")
    wheel_encoders: bool = Field(default=True, description="WENC_TYPE: without any, WHEEL_DISTANCE is denied")
    fastest_stream_hz: float = Field(default=25.0, gt=0.5, le=400.0, description="of the scheduler; a faster stream is denied")
    boot_s: float = Field(default=0.1, ge=0.0, le=60.0, description="from power-up to the first frame, after bytes that are none")
    estimate_s: float = Field(default=1.0, ge=0.0, le=600.0, description="from there to a position estimate, which arming needs")
    arming_refused: Text = Field(default="", description="why the pre-arm checks never pass; empty: they do")
    setpoint_timeout_s: float | None = Field(
        default=None, gt=0.05, le=60.0, description="GUID_TIMEOUT or COM_OF_LOSS_T; none: 3 s and 0.5 s"
    )
    has_timeout_parameter: bool = Field(default=True, description="ArduPilot before 4.7 has no GUID_TIMEOUT: always 3 s")
    gcs_failsafe: bool = Field(default=False, description="FS_GCS_ENABLE with FS_ACTION hold; off by default, as there")
    gcs_timeout_s: float = Field(default=1.5, gt=0.1, le=120.0, description="FS_TIMEOUT: without the station's heartbeats")
    heading_gain_per_s: float = Field(default=5.0, gt=0.1, le=50.0, description="PX4: RO_YAW_P")
    turn_on_spot_rad: float = Field(default=0.175, gt=0.01, le=3.0, description="PX4: RD_TRANS_DRV_TRN, of the heading's error")
    drive: DriveSettings = Field(
        default=DriveSettings(
            max_vx_m_s=2.0, max_wz_rad_s=4.0, acceleration_m_s2=1.5, stop_deceleration_m_s2=2.5, angular_acceleration_rad_s2=6.0,
            command_latency_s=0.0, motor_lag_s=0.2,
        ),
        description="its speed control: CRUISE_SPEED, ATC_ACCEL_MAX, ATC_DECEL_MAX, ATC_STR_ACC_MAX",
    )  # fmt: skip
    latency_s: float = Field(default=0.004, ge=0.0, le=1.0, description="of a message on its way to the host")
    loss_probability: float = Field(default=0.0005, ge=0.0, le=1.0, description="chance that a message is lost on the way")
    position_noise_m: float = Field(default=0.005, ge=0.0, le=10.0, description="deviation of the local position, without drift")
    battery_v: float = Field(default=27.8, gt=5.0, le=100.0, description="of the battery at the start")
    battery_sag_v: float = Field(default=0.4, ge=0.0, le=10.0, description="under full drive")
    battery_percent: int = Field(default=92, ge=-1, le=100, description="at the start; -1: it does not know")
    mass_kg: float = Field(default=17.0, gt=4.0, le=40.0, description="of the whole base, wheels included")
    friction: float = Field(default=0.6, gt=0.05, le=2.0, description="between tyres and floor")
    wheel_radius_error: tuple[Fraction, Fraction, Fraction, Fraction] = Field(
        default=(0.001, -0.0005, 0.0005, -0.001), description="how much larger each wheel really is, as a fraction (air)"
    )
    encoders: EncoderSettings = Field(
        default_factory=lambda: EncoderSettings(rate_hz=50.0, counts_per_rev=48_000, latency_s=0.0, loss_probability=0.0),
        description="wheel encoders",
    )
    imu_noise: ImuNoiseSettings = ImuNoiseSettings()
    faults: tuple[LinkFault, ...] = Field(default=(), description="misbehaviour, by script")
