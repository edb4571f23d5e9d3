"""Calibration of wheels by positions only, where the headings of the reference are not known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivers.interface.kinematics import WheelKinematics
from estimators.belief import F64
from estimators.calibration.drive import Drive
from estimators.calibration.identify import Identified, identify
from estimators.calibration.wheels import geometry_of, unknowns_of, wheel_path
from estimators.odometry.trajectory_error import aligned

POINT_STD_M = 0.02  # of a position on the wheels' path, after alignment
EASE = 2.0  # positions say less than poses do, so less is asked of them


def calibrate_wheels_to_points(drive: Drive, nominal: WheelKinematics) -> tuple[Identified, ...]:
    """Identify the geometry whose path, rigidly aligned, lies nearest to the positions; references' yaws are not looked at.

    Raises:
        ConfigurationError: the data do not determine a parameter.
    """
    truth = drive.references.pose[:, :2]

    def residuals(values: F64) -> F64:
        path = wheel_path(drive, geometry_of(nominal, values).kinematics)
        points = [np.interp(drive.references.time_s, drive.wheel_s, path[:, axis]) for axis in range(2)]
        return np.asarray(((aligned(np.stack(points, axis=1), truth) - truth) / POINT_STD_M).ravel())

    unknowns = tuple(replace(unknown, largest_std=EASE * unknown.largest_std) for unknown in unknowns_of(nominal))
    return identify(unknowns, residuals)
