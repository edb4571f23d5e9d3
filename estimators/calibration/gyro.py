"""The gyro's part of a calibration: which bias and scale turn its rates into the turns that were really made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from estimators.belief import F64
from estimators.calibration.drive import Drive
from estimators.calibration.identify import Identified, Unknown, identify

TURN_STD_RAD = 0.0005  # of a turn from one reference to the next
BIAS = Unknown("gyro_bias_rad_s", "rad/s", 0.0, 0.01, 0.001)
SCALE = Unknown("gyro_scale", "", 1.0, 0.02, 0.005)
DELAY = Unknown("gyro_late_s", "s", 0.0, 0.01, 0.01)


@dataclass(frozen=True, slots=True)
class GyroCalibration:
    """The true rate is scale times what the gyro says, less the bias."""

    bias_rad_s: float
    scale: float
    late_s: float
    found: tuple[Identified, ...]


def calibrate_gyro(drive: Drive) -> GyroCalibration:
    """Identify bias, scale and delay.  Raises ConfigurationError where the data do not determine one."""
    turned = np.diff(drive.references.pose[:, 2])
    said = np.concatenate(([0.0], cumulative_trapezoid(drive.gyro_rad_s, drive.gyro_s)))  # (g,)
    elapsed_s = np.diff(drive.references.time_s)

    def residuals(values: F64) -> F64:
        bias, scale, late_s = values
        turns = np.diff(np.interp(drive.references.time_s + late_s, drive.gyro_s, said))
        return np.asarray((scale * turns - bias * elapsed_s - turned) / TURN_STD_RAD)

    found = identify((BIAS, SCALE, DELAY), residuals)
    bias, scale, late_s = (parameter.value for parameter in found)
    return GyroCalibration(bias, scale, late_s, found)
