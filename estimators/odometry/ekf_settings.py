"""What the Kalman filter of the odometry believes of wheels and inertial unit."""

from __future__ import annotations

from pydantic import Field

from drivers.interface.settings import Settings


class EkfSettings(Settings):
    """Noises are densities where the unit says sqrt_hz; the defaults are wide enough for a robot that is not calibrated.

    Gyro and accelerometer are taken to be a BMI055 (see `sim_drivers/imu_noise.py` for its figures) whose lever arm, tilt and
    scale are not known, which is what most of their noise here stands for.
    """

    late_max_s: float = Field(default=0.3, ge=0.0, le=5.0, description="a sample that comes later than this is dropped")
    gyro_noise_rad_s_sqrt_hz: float = Field(default=3e-4, gt=0.0, le=1.0, description="white noise of the yaw rate")
    gyro_walk_rad_s2_sqrt_hz: float = Field(default=2e-5, gt=0.0, le=0.1, description="random walk of its bias")
    gyro_bias_std_rad_s: float = Field(default=0.0175, gt=0.0, le=1.0, description="of the bias at the start; BMI055: 1 deg/s")
    gyro_bias_max_rad_s: float = Field(default=0.2, gt=0.0, le=5.0, description="a larger one means wrong units: diverged")
    accel_noise_m_s2_sqrt_hz: float = Field(default=0.03, gt=0.0, le=10.0, description="white noise, lever arm and vibration")
    jerk_max_m_s3: float = Field(
        default=15.0, ge=0.0, le=1e3, description="how fast specific force changes, at most, between samples that do not show it"
    )
    turn_jerk_max_rad_s3: float = Field(
        default=60.0, ge=0.0, le=1e4, description="the same for the turn: how fast its acceleration changes"
    )
    accel_walk_m_s3_sqrt_hz: float = Field(default=2e-3, gt=0.0, le=1.0, description="random walk of its bias, tilt included")
    accel_bias_std_m_s2: float = Field(default=0.3, gt=0.0, le=10.0, description="of the bias at the start, tilt included")
    accel_min_m_s2: float = Field(default=3.0, ge=0.0, le=9.0, description="less specific force is no gravity: wrong units")
    accel_max_m_s2: float = Field(default=80.0, gt=10.0, le=400.0, description="more is no drive on wheels: wrong units")
    blind_accel_m_s2_sqrt_hz: float = Field(default=0.7, gt=0.0, le=10.0, description="how motion changes that nobody measures")
    blind_turn_rad_s_sqrt_hz: float = Field(default=0.3, gt=0.0, le=10.0, description="the same for the yaw rate, without a gyro")
    gap_max_s: float = Field(
        default=0.05, gt=0.0, le=1.0, description="a unit that is silent for longer is not interpolated; more for one below 25 Hz"
    )
    blind_max_s: float = Field(default=0.5, gt=0.0, le=10.0, description="after so long without a sample the motion is unknown")
    encoder_noise_rad: float = Field(default=1e-3, gt=0.0, le=0.1, description="of a wheel's turn between two samples")
    stamp_std_s: float = Field(
        default=1e-3, ge=0.0, le=0.1, description="of the stamp of each wheel: most are those of an arrival at the host"
    )
    speed_unknown_std_m_s: float = Field(
        default=0.1, gt=0.0, le=10.0, description="a velocity that is less certain, as after a gap, is that of the wheels"
    )
    still_rad: float = Field(
        default=4e-3, ge=0.0, le=0.1, description="wheels that turn no further than their counting jitters stand"
    )
    still_after_s: float = Field(default=0.3, gt=0.0, le=10.0, description="and the base with them, after this; at once at start")
    still_rate_rad_s: float = Field(default=0.01, ge=0.0, le=1.0, description="if the gyro, too, turns no faster than this")
    still_std: float = Field(
        default=2e-5, gt=0.0, le=1e-2, description="m and rad: how far a base that stands moves between samples"
    )
    position_variance_m2_per_m: float = Field(default=2e-4, ge=0.0, le=1.0, description="slip of the wheels, each axis")
    position_variance_m2_per_rad: float = Field(default=2e-5, ge=0.0, le=1.0, description="slip of the wheels in turning")
    skid_along_std_m_per_rad: float = Field(
        default=0.0, ge=0.0, le=5.0, description="how wrong the way is forwards where a base skids in turns"
    )
    skid_across_std_m_per_rad: float = Field(default=0.0, ge=0.0, le=5.0, description="and sideways")
    yaw_variance_rad2_per_m: float = Field(default=1e-4, ge=0.0, le=1.0, description="slip of the wheels")
    yaw_variance_rad2_per_rad: float = Field(default=2e-3, ge=0.0, le=1.0, description="slip of the wheels in turning")
    way_scale_std: float = Field(default=0.03, ge=0.0, le=1.0, description="the wheels' way is wrong by this fraction")
    yaw_scale_std: float = Field(default=0.05, ge=0.0, le=1.0, description="the wheels' turning is wrong by this fraction")
    yaw_std_rad_per_m: float = Field(default=0.02, ge=0.0, le=1.0, description="and by this a metre: unequal wheels turn a base")
    systematic_s: float = Field(
        default=60.0, ge=0.0, le=3600.0, description="that is wrong for so long, and must not pass for a bias of the gyro"
    )
    innovation_gate: float = Field(default=16.3, gt=1.0, le=1e3, description="normalised, squared; chi-square, 3 dof: 99.9 %")
    skip_ratio: float = Field(
        default=4.0, ge=1.0, le=1e3, description="beyond gate times this an update is skipped, not only eased"
    )
    diverged_after_s: float = Field(default=3.0, gt=0.0, le=60.0, description="wheels that disagree for so long: diverged")
    pose_std_min_m: float = Field(default=0.005, gt=0.0, le=1.0, description="no device's absolute pose is believed better")
    yaw_std_min_rad: float = Field(default=0.002, gt=0.0, le=1.0, description="nor its yaw")
