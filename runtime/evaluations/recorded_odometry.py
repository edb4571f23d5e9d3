"""Wheel odometry on a recorded drive with known positions: nominal parameters, and those fitted on its other half."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from drivers.interface.errors import ConfigurationError
from drivers.interface.kinematics import SkidSteer
from drivers.wheel_log import WheelLog, read_wheel_log
from estimators.calibration.drive import Drive, References
from estimators.calibration.points import calibrate_wheels_to_points
from estimators.calibration.wheels import wheel_path
from estimators.odometry.trajectory_error import absolute_error_m, relative_error_m
from estimators.odometry.wheel_geometry import TwoSided

F64 = NDArray[np.float64]
APART = 8  # samples, one second of the recording


@dataclass(frozen=True, slots=True)
class RecordedScore:
    """The errors on one half of a recording, by the drawing's parameters and by those fitted on the other half."""

    half: str
    way_m: float
    nominal: TrajectoryError
    fitted: TrajectoryError


@dataclass(frozen=True, slots=True)
class TrajectoryError:
    """Absolute error after alignment, and relative error over a second."""

    absolute_m: float
    relative_m: float


def score_recording(wheels: Path, truth: Path) -> tuple[RecordedScore, RecordedScore]:
    """Score either half of a recording with what was fitted on the other one.

    Raises:
        ConfigurationError: a file cannot be read, or a half does not determine a parameter.
    """
    log, points = read_wheel_log(wheels), read_points(truth)
    nominal = SkidSteer(1.0, log.track_m, wheel_count=2)  # the file gives rim velocities: a radius of 1 m makes them rates
    first, second = halves(log, points)
    return _crossed("first", first, second, nominal), _crossed("second", second, first, nominal)


def _crossed(half: str, scored: Drive, fitted_on: Drive, nominal: SkidSteer) -> RecordedScore:
    left_m, right_m, track_m = (parameter.value for parameter in calibrate_wheels_to_points(fitted_on, nominal))
    way_m = float(np.sum(np.linalg.norm(np.diff(scored.references.pose[:, :2], axis=0), axis=1)))
    return RecordedScore(half, way_m, _error(scored, nominal), _error(scored, TwoSided(left_m, right_m, track_m, 2)))


def halves(log: WheelLog, points: F64) -> tuple[Drive, Drive]:
    """Return the drive before and after its middle; `points`, shape (k, 3), are time [s], x, y [m]."""
    angle = np.concatenate((np.zeros((2, 1)), cumulative_trapezoid(log.rim_m_s.T, log.time_s)), axis=1).T  # (n, 2)
    inside = points[(points[:, 0] >= log.time_s[0]) & (points[:, 0] <= log.time_s[-1])]
    middle_s = 0.5 * (inside[0, 0] + inside[-1, 0])
    return _part(log, angle, inside[inside[:, 0] <= middle_s]), _part(log, angle, inside[inside[:, 0] >= middle_s])


def read_points(path: Path) -> F64:
    """Return the `point2` lines of a file as time [s], x, y [m], shape (k, 3).

    Raises:
        ConfigurationError: the file cannot be read or holds too few of them.
    """
    try:
        lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("point2")]
        points = np.array([[float(value) for value in line[1:4]] for line in lines])
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise ConfigurationError(f"cannot read the positions in '{path}': {error}") from error
    if points.ndim != 2 or points.shape[0] < 4 * APART or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ConfigurationError(f"'{path}' holds too few point2 lines of time, x and y")
    return points


def _part(log: WheelLog, angle: F64, points: F64) -> Drive:
    use = (log.time_s >= points[0, 0] - 1.0) & (log.time_s <= points[-1, 0] + 1.0)
    pose = np.column_stack((points[:, 1:], np.zeros(len(points))))
    return Drive(log.time_s[use], angle[use], np.zeros(0), np.zeros(0), References(points[:, 0], pose))


def _error(drive: Drive, kinematics: SkidSteer | TwoSided) -> TrajectoryError:
    path, truth = wheel_path(drive, kinematics), drive.references.pose[:, :2]
    points = np.stack([np.interp(drive.references.time_s, drive.wheel_s, path[:, axis]) for axis in range(2)], axis=1)
    return TrajectoryError(absolute_error_m(points, truth), relative_error_m(points, truth, APART))
