"""The wheels' part of a calibration: which geometry turns the wheels' turns into the ways that were really made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from drivers.interface.errors import ConfigurationError
from drivers.interface.kinematics import OmniThreeWheel, SkidSteer, WheelKinematics
from estimators.belief import F64
from estimators.calibration.drive import Drive, relative, ways
from estimators.calibration.identify import Identified, Unknown, identify
from estimators.odometry.wheel_geometry import OmniGeometry, SkidSteerGeometry, TwoSided

MOMENT_S = 0.03  # to either side
WAY_STD = (0.001, 0.001, 0.001)  # m, m, rad: of a way from one reference to the next
RADIUS_STD, DISTANCE_STD = 0.005, 0.01  # fractions: what is worse determined is not used
HEADING_STD_RAD, DELAY_STD_S = 0.006, 0.01
DELAY = Unknown("wheels_late_s", "s", 0.0, 0.01, DELAY_STD_S)


@dataclass(frozen=True, slots=True)
class WheelCalibration:
    """The geometry that was found, and how late its samples' stamps are against the references."""

    geometry: OmniGeometry | SkidSteerGeometry
    late_s: float
    found: tuple[Identified, ...]


def calibrate_wheels(drive: Drive, nominal: WheelKinematics) -> WheelCalibration:
    """Identify a base's geometry.

    Raises:
        ConfigurationError: the data do not determine a parameter, or the base is of a kind that has none to identify.
    """
    unknowns = (*unknowns_of(nominal), DELAY)
    measured = ways(drive.references)

    def residuals(values: F64) -> F64:
        made = wheel_ways(drive, geometry_of(nominal, values[:-1]).kinematics, float(values[-1]))
        return np.asarray(((made - measured) / WAY_STD).ravel())

    found = identify(unknowns, residuals)
    values = np.array([parameter.value for parameter in found])
    return WheelCalibration(geometry_of(nominal, values[:-1]), float(values[-1]), found)


def wheel_path(drive: Drive, kinematics: WheelKinematics) -> F64:
    """Return the path that the wheels alone give, shape (n, 3): x, y [m], yaw [rad], from the origin."""
    twists = np.array([_row(kinematics, turn) for turn in np.eye(kinematics.wheel_count)]).T  # (3, wheels)
    steps = np.diff(drive.wheel_rad, axis=0) @ twists.T  # (n - 1, 3)
    yaw = np.concatenate(([0.0], np.cumsum(steps[:, 2])))
    half = 0.5 * steps[:, 2]
    chord = np.sinc(half / np.pi)  # of the exact arc
    heading = yaw[:-1] + half
    c, s = chord * np.cos(heading), chord * np.sin(heading)
    dx, dy = c * steps[:, 0] - s * steps[:, 1], s * steps[:, 0] + c * steps[:, 1]
    return np.stack((np.concatenate(([0.0], np.cumsum(dx))), np.concatenate(([0.0], np.cumsum(dy))), yaw), axis=1)


def wheel_ways(drive: Drive, kinematics: WheelKinematics, late_s: float = 0.0) -> F64:
    """Return the ways between the references as the wheels give them, shape (k - 1, 3)."""
    path, at_s = wheel_path(drive, kinematics), drive.references.time_s + late_s
    # The mean over a moment: between two samples the noise of counting is less than at one, and a delay would hide there.
    areas = np.concatenate((np.zeros((3, 1)), cumulative_trapezoid(path.T, drive.wheel_s)), axis=1)  # (3, n)
    start_s, end_s = (np.clip(at_s + side, drive.wheel_s[0], drive.wheel_s[-1]) for side in (-MOMENT_S, MOMENT_S))
    swept = [np.interp(end_s, drive.wheel_s, area) - np.interp(start_s, drive.wheel_s, area) for area in areas]
    poses = (swept / (end_s - start_s)).T
    return relative(poses[:-1], poses[1:])


def _row(kinematics: WheelKinematics, turn: F64) -> tuple[float, float, float]:
    twist = kinematics.twist(turn)
    return twist.vx, twist.vy, twist.wz


def unknowns_of(nominal: WheelKinematics) -> tuple[Unknown, ...]:
    """Return what is not known of a base of this kind.  Raises ConfigurationError where the kind has nothing to identify."""
    match nominal:
        case OmniThreeWheel():
            radii = [_length(f"wheel_radius_m[{i}]", r, RADIUS_STD) for i, r in enumerate(nominal.wheel_radius_m)]
            distances = [_length(f"wheel_distance_m[{i}]", d, DISTANCE_STD) for i, d in enumerate(nominal.wheel_distance_m)]
            errors = enumerate(nominal.heading_error_rad)
            headings = [Unknown(f"heading_error_rad[{i}]", "rad", h, 0.02, HEADING_STD_RAD) for i, h in errors]
            return (*radii, *distances, *headings)
        case SkidSteer():
            radii = [_length(f"{side}_radius_m", nominal.wheel_radius_m, RADIUS_STD) for side in ("left", "right")]
            return (*radii, _length("effective_track_m", nominal.effective_track_m, DISTANCE_STD))
        case TwoSided():
            sides = (("left", nominal.left_radius_m), ("right", nominal.right_radius_m))
            radii = [_length(f"{side}_radius_m", radius, RADIUS_STD) for side, radius in sides]
            return (*radii, _length("effective_track_m", nominal.effective_track_m, DISTANCE_STD))
        case _:
            raise ConfigurationError(f"calibration knows omni and skid-steer bases, not a {type(nominal).__name__}")


def _length(name: str, nominal_m: float, largest_share: float) -> Unknown:
    return Unknown(name, "m", nominal_m, 0.02 * nominal_m, largest_share * nominal_m)


def geometry_of(nominal: WheelKinematics, values: F64) -> OmniGeometry | SkidSteerGeometry:
    """Return the geometry that the values of `unknowns_of` stand for."""
    v = [float(value) for value in values]
    if isinstance(nominal, OmniThreeWheel):
        radii, distances, headings = (v[0], v[1], v[2]), (v[3], v[4], v[5]), (v[6], v[7], v[8])
        return OmniGeometry.model_construct(
            wheel_radius_m=radii,
            wheel_distance_m=distances,
            wheel_bearing_rad=nominal.wheel_bearing_rad,
            heading_error_rad=headings,
        )
    return SkidSteerGeometry.model_construct(
        left_radius_m=v[0], right_radius_m=v[1], effective_track_m=v[2], wheel_count=nominal.wheel_count
    )
