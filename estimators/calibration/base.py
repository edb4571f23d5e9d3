"""The calibration of a base: wheels and gyro together, with the odometry's error before and after."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivers.interface.kinematics import WheelKinematics
from estimators.belief import F64
from estimators.calibration.drive import LEAST_SAMPLES, Drive, ways
from estimators.calibration.gyro import GyroCalibration, calibrate_gyro
from estimators.calibration.identify import Identified
from estimators.calibration.wheels import WheelCalibration, calibrate_wheels, wheel_ways

LEAST_SCALE_STD = 0.01  # load, wear and floor change more than a drive determines


@dataclass(frozen=True, slots=True)
class DriftError:
    """How far the wheels' own reckoning strays from the references."""

    way_rms_m: float  # of the ways from one reference to the next
    turn_rms_rad: float
    end_m: float  # at the end of the drive
    end_rad: float


@dataclass(frozen=True, slots=True)
class WheelTrust:
    """How far calibrated wheels can be believed, in the terms of `EkfSettings`."""

    way_scale_std: float
    yaw_scale_std: float
    position_variance_m2_per_m: float
    position_variance_m2_per_rad: float
    yaw_variance_rad2_per_m: float
    yaw_variance_rad2_per_rad: float


@dataclass(frozen=True, slots=True)
class BaseCalibration:
    """What a drive has told; `gyro` is None on a robot that has none."""

    wheels: WheelCalibration
    gyro: GyroCalibration | None
    before: DriftError
    after: DriftError
    trust: WheelTrust | None  # None: the references say too little of slip and scale
    held: tuple[str, ...] = ()  # what no such references can tell, and what therefore stays as it was

    @property
    def found(self) -> tuple[Identified, ...]:
        """Every parameter, wheels first."""
        return self.wheels.found + (() if self.gyro is None else self.gyro.found)

    @property
    def wheels_late_s(self) -> float:
        """How much later than the gyro's the wheels' stamps are."""
        return 0.0 if self.gyro is None else self.wheels.late_s - self.gyro.late_s


def calibrate_base(drive: Drive, nominal: WheelKinematics) -> BaseCalibration:
    """Identify everything that the drive determines.

    Raises:
        ConfigurationError: it does not determine a parameter; the sentence names it.
    """
    wheels = calibrate_wheels(drive, nominal)
    gyro = calibrate_gyro(drive) if len(drive.gyro_s) >= LEAST_SAMPLES else None
    calibrated = wheels.geometry.kinematics
    before, after = drift_error(drive, nominal), drift_error(drive, calibrated, wheels.late_s)
    return BaseCalibration(wheels, gyro, before, after, wheel_trust(drive, wheels))


def wheel_trust(drive: Drive, wheels: WheelCalibration) -> WheelTrust:
    """Return what the residuals say of slip, and the parameters' standard deviations of the geometry.

    Each variance is that of all residuals over all ways, or over all turns: an upper bound, as neither alone has caused them.
    """
    made, true = wheel_ways(drive, wheels.geometry.kinematics, wheels.late_s), ways(drive.references)
    position = 0.5 * float(np.sum((made - true)[:, :2] ** 2))
    yaw = float(np.sum((made - true)[:, 2] ** 2))
    way_m, turned_rad = float(np.sum(np.linalg.norm(true[:, :2], axis=1))), float(np.sum(np.abs(true[:, 2])))
    return WheelTrust(
        way_scale_std=max(LEAST_SCALE_STD, _worst(wheels.found, "radius_m")),
        yaw_scale_std=max(LEAST_SCALE_STD, _worst(wheels.found, "distance_m"), _worst(wheels.found, "track_m")),
        position_variance_m2_per_m=position / way_m,
        position_variance_m2_per_rad=position / turned_rad,
        yaw_variance_rad2_per_m=yaw / way_m,
        yaw_variance_rad2_per_rad=yaw / turned_rad,
    )


def _worst(found: tuple[Identified, ...], kind: str) -> float:
    """Return the largest relative standard deviation among parameters of a kind, by a part of their names."""
    return max((parameter.std / parameter.value for parameter in found if kind in parameter.unknown.name), default=0.0)


def drift_error(drive: Drive, kinematics: WheelKinematics, late_s: float = 0.0) -> DriftError:
    """Return the error of dead reckoning by a geometry, against the references."""
    made, true = wheel_ways(drive, kinematics, late_s), ways(drive.references)
    wrong = made - true
    end = chained(made) - chained(true)
    return DriftError(
        way_rms_m=float(np.sqrt(np.mean(np.sum(wrong[:, :2] ** 2, axis=1)))),
        turn_rms_rad=float(np.sqrt(np.mean(wrong[:, 2] ** 2))),
        end_m=math.hypot(float(end[0]), float(end[1])),
        end_rad=abs(float(end[2])),
    )


def chained(ways_made: F64) -> F64:
    """Return where the ways lead one after the other, shape (3,)."""
    yaw = np.concatenate(([0.0], np.cumsum(ways_made[:, 2])))
    c, s = np.cos(yaw[:-1]), np.sin(yaw[:-1])
    x, y = ways_made[:, 0], ways_made[:, 1]
    return np.array((np.sum(c * x - s * y), np.sum(s * x + c * y), yaw[-1]))
