"""The pose at which a frame lies best on reference lines, given where it was expected: Gauss-Newton, and what it determines."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import wrap_angle
from estimators.belief import F64
from estimators.registration.reference_lines import ReferenceLines
from estimators.registration.registration_kernels import match_points, normal_equations
from estimators.registration.registration_settings import RegistrationSettings
from estimators.registration.straight_pieces import StraightPieces

SETTLED = 1e-5  # a step so small [m, rad] ends the iterations
NO_SPREAD = np.zeros((3, 3))


@dataclass(frozen=True, slots=True)
class Expected:
    """Where the base should be in map, before the frame is looked at."""

    pose: F64  # (3,), x, y [m], yaw [rad]
    covariance: F64  # (3, 3)


@dataclass(frozen=True, slots=True)
class Alignment:
    """Where the base is in map, the frame looked at."""

    pose: F64  # (3,), x, y [m], yaw [rad]
    covariance: F64  # (3, 3)
    undetermined: F64  # (k, 3), orthonormal directions of x, y [m], yaw [rad] along which the frame says nothing
    line: NDArray[np.int64]  # (n,), on which line each point lies, negative for none
    points: int  # that lie on lines which may move the pose
    residual_m: float  # weighted RMS of their distances
    believed: bool  # False: it asks for more than can be, and the pose is the expected one


@dataclass(frozen=True, slots=True)
class _Equations:
    information: F64  # (3, 3), only of determined directions
    pull: F64  # (3,), as well
    determined: F64  # (3, 3), projects on them
    undetermined: F64  # (k, 3)
    points: int
    residual_m: float


def align(
    found: StraightPieces, noise_m: F64, expected: Expected, lines: ReferenceLines, settings: RegistrationSettings
) -> Alignment:
    """Lay straight pieces in base, with points of the given deviations, shape (n,), on the lines.

    The prior is a normal distribution around the expected pose; along undetermined directions the pose stays as expected.
    """
    prior = np.linalg.inv(expected.covariance)
    line = np.empty(len(found.points), dtype=np.int64)
    pose, spread = expected.pose.copy(), expected.covariance
    for _ in range(settings.iterations_max):
        _match(found, pose, spread, lines, settings, line)
        equations = _equations(found, noise_m, line, pose, lines, settings)
        spread = NO_SPREAD  # the first match was a guess that the prediction's spread excuses
        moved = _apart(pose, expected.pose)
        step = np.linalg.solve(prior + equations.information, equations.pull - prior @ moved)
        target = equations.determined @ (moved + step)
        pose = expected.pose + target
        if float(np.abs(target - moved).max()) < SETTLED:
            break
    covariance = np.linalg.inv(prior + equations.information)
    believed = _is_believed(_apart(pose, expected.pose), settings)
    if not believed:
        pose, covariance = expected.pose, expected.covariance
        line[:] = -1
    pose = np.array([pose[0], pose[1], wrap_angle(float(pose[2]))])
    covariance = 0.5 * (covariance + covariance.T)
    return Alignment(pose, covariance, equations.undetermined, line, equations.points, equations.residual_m, believed)


def _apart(pose: F64, other: F64) -> F64:
    return np.array([pose[0] - other[0], pose[1] - other[1], wrap_angle(float(pose[2] - other[2]))])


def _is_believed(correction: F64, settings: RegistrationSettings) -> bool:
    """A NaN is not."""
    far = math.hypot(correction[0], correction[1])
    return far <= settings.correction_max_m and abs(float(correction[2])) <= settings.correction_max_rad


def _match(
    found: StraightPieces, pose: F64, spread: F64, lines: ReferenceLines, settings: RegistrationSettings, line: NDArray[Any]
) -> None:
    gates = (settings.gate_m, settings.gate_max_m, settings.beyond_m, math.cos(settings.gate_angle_rad))
    match_points(found.points, found.piece, found.direction, pose, spread, gates, lines.normal, lines.offset, lines.ends, line)


def _equations(
    found: StraightPieces, noise_m: F64, line: NDArray[Any], pose: F64, lines: ReferenceLines, settings: RegistrationSettings
) -> _Equations:
    """Return the normal equations, without the directions that the points do not determine.

    The information is less than independent errors of the assumed size would give: by how many neighbours share one error, and
    by how much larger the errors are.
    """
    information, pull, geometry = np.empty((3, 3)), np.empty(3), np.empty((3, 3))
    count, weight, square = normal_equations(
        found.points, noise_m, line, pose, lines.normal, lines.offset, lines.trusted, information, pull, geometry
    )
    if count < settings.points_min:
        return _Equations(np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3)), np.eye(3), count, 0.0)
    shares, directions = np.linalg.eigh(geometry)
    sure = shares >= settings.determined_share
    determined = directions[:, sure] @ directions[:, sure].T
    trust = 1.0 / (settings.correlated_points * max(1.0, square / count))
    return _Equations(
        trust * (determined @ information @ determined),
        trust * (determined @ pull),
        determined,
        directions[:, ~sure].T,
        count,
        math.sqrt(square / weight),
    )
