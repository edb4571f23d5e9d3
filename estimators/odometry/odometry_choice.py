"""Which kind of odometry runs, and what all kinds are told."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from drivers.interface.kinematics import WheelKinematics
from estimators.odometry.dead_reckoning import DeadReckoning, DeadReckoningSettings
from estimators.odometry.ekf_settings import EkfSettings
from estimators.odometry.odometry import Odometry
from estimators.odometry.odometry_limits import MotionLimits
from estimators.odometry.wheel_geometry import OmniGeometry, SkidSteerGeometry

Geometry = Annotated[OmniGeometry | SkidSteerGeometry, Field(discriminator="kind")]


class OdometrySettings(DeadReckoningSettings):
    """Dead reckoning's own settings, those that both kinds share, and the filter's.

    The filter is the default: on squares in both senses, on ideal wheels, rollers and a skid-steer base, with a rest at the start
    or without, it ends several times nearer to the truth (`trundle evaluate odometry`).  Dead reckoning starts faster and
    carries 60 MB less.
    """

    kind: Literal["dead_reckoning", "ekf"] = Field(default="ekf", description="wheels alone, or fused with the IMU")
    geometry: Geometry | None = Field(default=None, description="as calibrated; none: the base's own")
    gyro_bias_rad_s: float = Field(default=0.0, ge=-1.0, le=1.0, description="as calibrated: true rate = scale * gyro - bias")
    gyro_scale: float = Field(default=1.0, ge=0.5, le=2.0, description="as calibrated")
    wheels_late_s: float = Field(default=0.0, ge=-0.1, le=0.1, description="as calibrated: of their stamps, against the gyro's")
    ekf: EkfSettings = EkfSettings()


def build_odometry(
    settings: OdometrySettings, kinematics: WheelKinematics | None, imu_in_base_m: tuple[float, float] = (0.0, 0.0)
) -> Odometry:
    """Return the odometry that the settings name; a calibrated geometry takes the place of the base's own `kinematics`."""
    if settings.geometry is not None:
        kinematics = settings.geometry.kinematics
    if settings.kind == "dead_reckoning":
        return DeadReckoning(settings, kinematics)
    from estimators.odometry.ekf_odometry import EkfOdometry  # noqa: PLC0415 - FilterPy brings 40 MB that only those who filter need carry

    limits = MotionLimits(
        settings.speed_max_m_s,
        settings.turn_rate_max_rad_s,
        settings.gyro_bias_rad_s,
        settings.gyro_scale,
        settings.wheels_late_s,
        *imu_in_base_m,
    )
    trail_s, beyond_s = settings.trail_s, settings.extrapolation_max_s
    return EkfOdometry(settings.ekf, limits, kinematics, trail_s=trail_s, extrapolation_max_s=beyond_s)
