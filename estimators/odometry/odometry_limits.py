"""What every kind of odometry is told of the base and its gyro."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """How fast the base can be, and what calibration found out about its gyro."""

    speed_max_m_s: float
    turn_rate_max_rad_s: float
    gyro_bias_rad_s: float = 0.0
    gyro_scale: float = 1.0  # true rate = scale times what the gyro says, less the bias
    wheels_late_s: float = 0.0  # how much later than the gyro's the wheels' stamps are
    imu_x_m: float = 0.0  # where the accelerometer sits in base
    imu_y_m: float = 0.0
