"""Calibration by loops that end at the mark where they began, with no other reference.

Borenstein, Feng, UMBmark: a benchmark test for measuring odometry errors in mobile robots, 1995: closed ways in both senses tell
the ratio of the wheels and the track, and never the mean radius.  For any base it holds: what changes all ways by one similarity
(lengths scaled, the base's own frame shifted or turned) closes every loop as well as before.  Such changes stay out of the fit.
An omni base needs loops that go out along one bearing and come back along another; in a square driven forwards, what is wrong
along one axis cancels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import trapezoid

from drivers.interface.errors import ConfigurationError
from drivers.interface.kinematics import OmniThreeWheel, WheelKinematics
from estimators.belief import F64
from estimators.calibration.base import BaseCalibration, DriftError
from estimators.calibration.drive import LEAST_SAMPLES, Drive, ways
from estimators.calibration.gyro import BIAS, SCALE, GyroCalibration
from estimators.calibration.identify import Unknown, identify
from estimators.calibration.loops import require_both_senses
from estimators.calibration.wheels import (
    DISTANCE_STD,
    HEADING_STD_RAD,
    RADIUS_STD,
    WheelCalibration,
    geometry_of,
    unknowns_of,
    wheel_ways,
)

CLOSURE_STD = (0.01, 0.01, 0.01)  # m, m, rad: of putting the base back onto the mark
GYRO_STD_RAD = 0.01
LARGEST_MISS = 6.0  # standard deviations by which a loop that is put down to the wheels may still fail to close


@dataclass(frozen=True, slots=True)
class _Family:
    """What loops can tell of a kind of base: directions in which its parameters may move, and what else is held."""

    unknowns: tuple[Unknown, ...]
    directions: F64  # (parameters, unknowns)
    held: tuple[str, ...]


def calibrate_loops(loops: Sequence[Drive], nominal: WheelKinematics) -> BaseCalibration:
    """Identify what loops (see `loops_of`) tell of wheels and gyro.

    Raises:
        ConfigurationError: the loops do not determine a parameter that loops could (named), or no wheels would close them.
    """
    require_both_senses(loops, nominal)
    family = _family(nominal)
    start = np.array([unknown.nominal for unknown in unknowns_of(nominal)])
    true = np.concatenate([ways(loop.references) for loop in loops])

    def residuals(values: F64) -> F64:
        kinematics = geometry_of(nominal, start + family.directions @ values).kinematics
        return np.asarray(((_made(loops, kinematics) - true) / CLOSURE_STD).ravel())

    found = identify(family.unknowns, residuals)
    values = np.array([parameter.value for parameter in found])
    geometry = geometry_of(nominal, start + family.directions @ values)
    _require_closed(residuals(values))
    gyro = _gyro(loops) if all(len(loop.gyro_s) >= LEAST_SAMPLES for loop in loops) else None
    before, after = _missed(_made(loops, nominal) - true), _missed(_made(loops, geometry.kinematics) - true)
    return BaseCalibration(WheelCalibration(geometry, 0.0, found), gyro, before, after, None, family.held)


def _require_closed(missed: F64) -> None:
    worst = float(np.abs(missed).max())
    if worst > LARGEST_MISS:
        raise ConfigurationError(
            f"calibration: no wheels of this kind would close these loops (the worst is off by {worst:.0f} standard deviations "
            "of putting the base back); each loop must begin and end on the same mark, heading included"
        )


def _made(loops: Sequence[Drive], kinematics: WheelKinematics) -> F64:
    return np.concatenate([wheel_ways(loop, kinematics) for loop in loops])


def _missed(wrong: F64) -> DriftError:
    """Return by how much the loops, shape (loops, 3), fail to close: over all of them, and at the end of the worst."""
    position, yaw = np.linalg.norm(wrong[:, :2], axis=1), np.abs(wrong[:, 2])
    way_m, turn_rad = (float(np.sqrt(np.mean(error**2))) for error in (position, yaw))
    return DriftError(way_m, turn_rad, end_m=float(position.max()), end_rad=float(yaw.max()))


def _gyro(loops: Sequence[Drive]) -> GyroCalibration:
    """Identify bias and scale; loops say nothing of a delay."""
    said = np.array([trapezoid(loop.gyro_rad_s, loop.gyro_s) for loop in loops])
    elapsed_s = np.array([loop.gyro_s[-1] - loop.gyro_s[0] for loop in loops])
    turned = np.array([loop.references.pose[-1, 2] for loop in loops])
    found = identify((BIAS, SCALE), lambda v: np.asarray((v[1] * said - v[0] * elapsed_s - turned) / GYRO_STD_RAD))
    return GyroCalibration(found[0].value, found[1].value, 0.0, found)


def _family(nominal: WheelKinematics) -> _Family:
    nominals = np.array([unknown.nominal for unknown in unknowns_of(nominal)])
    if isinstance(nominal, OmniThreeWheel):
        return _omni(nominals)
    directions = np.zeros((3, 2))
    directions[:, 0] = 0.5 * nominals[0], -0.5 * nominals[1], 0.0
    directions[2, 1] = nominals[2]
    ratio = Unknown("left_radius_m / right_radius_m - 1", "", 0.0, 0.02, RADIUS_STD)
    track = Unknown("effective_track_m / nominal - 1", "", 0.0, 0.05, DISTANCE_STD)
    return _Family((ratio, track), directions, ("mean of left_radius_m and right_radius_m",))


def _omni(nominals: F64) -> _Family:
    """Radii and headings against those of the first wheel, their means held, and all distances in one proportion."""
    directions = np.zeros((9, 5))
    apart = np.array(((-1.0, -1.0), (2.0, -1.0), (-1.0, 2.0))) / 3.0  # columns sum to zero, and differ from the first by one
    directions[0:3, 0:2] = nominals[0:3, None] * apart
    directions[3:6, 2] = nominals[3:6]
    directions[6:9, 3:5] = apart
    radii = [Unknown(f"wheel_radius_m[{i}] / [0] - 1", "", 0.0, 0.02, RADIUS_STD) for i in (1, 2)]
    distance = Unknown("wheel_distance_m / nominal - 1", "", 0.0, 0.02, DISTANCE_STD)
    headings = [Unknown(f"heading_error_rad[{i}] - [0]", "rad", 0.0, 0.02, HEADING_STD_RAD) for i in (1, 2)]
    held = ("mean of wheel_radius_m", "differences of wheel_distance_m", "mean of heading_error_rad")
    return _Family((*radii, distance, *headings), directions, held)
