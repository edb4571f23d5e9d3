"""What the barriers of the field-CBF are made of: the paper's boundary samples, and the two forms that its table 2 comes from."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from drivers.interface.kernel import kernel
from estimators.belief import F32, Belief, Mask
from planners.shields.field_cbf_kernels import F64, Barrier, boundary_samples, filter_velocity, own_gradient


class Answer(NamedTuple):
    """What the filter found, in the order of `filter_velocity`."""

    vx: float
    vy: float
    boundaries: F64  # (n, 2), sampled, in odom
    constraining: F64  # (m, 2), of these
    nearest_m: float
    slack_m_s: float
    enclosed: bool


class Asked(NamedTuple):
    """The velocity asked and the box of what is reachable, vx and vy in the body frame, shape (2,) each."""

    velocity: F64
    lowest: F64
    highest: F64


Form = Callable[[Belief, Asked, Barrier], Answer]


def boundaries(belief: Belief, asked: Asked, barrier: Barrier) -> Answer:
    """Filter by the nearest boundary in each direction (equation 5)."""
    field = belief.clearance
    at = field.lattice
    corner = np.array([at.x_m, at.y_m])
    return Answer(
        *_by_boundaries(field.clearance_m, field.rate_m_s, field.overlap, corner, at.cell_m, _pose(belief), *asked, barrier)
    )


def single_scalar(belief: Belief, asked: Asked, barrier: Barrier) -> Answer:
    """Filter by the clearance at the robot, its slope and rate, as one boundary."""
    field = belief.clearance
    at = field.lattice
    corner = np.array([at.x_m, at.y_m])
    return Answer(
        *_by_own_gradient(field.clearance_m, field.rate_m_s, field.overlap, corner, at.cell_m, _pose(belief), *asked, barrier)
    )


def objects(belief: Belief, asked: Asked, barrier: Barrier) -> Answer:
    """Filter by the belief's tracks, as discs that move on; `estimator.tracks` says where they come from, walls are none."""
    pose = _pose(belief)
    away = pose[:2] - np.array([track.position_in_odom for track in belief.tracks]).reshape(-1, 2)
    reach = np.maximum(np.hypot(away[:, 0], away[:, 1]), 1e-9)
    normal = away / reach[:, None]
    velocity = np.array([track.velocity_in_odom for track in belief.tracks]).reshape(-1, 2)
    distance = reach - np.array([track.radius_m for track in belief.tracks])
    return Answer(*filter_velocity(normal, distance, -(normal * velocity).sum(axis=1), False, pose, *asked, barrier))


FORMS: dict[str, Form] = {"boundaries": boundaries, "single_scalar": single_scalar, "objects": objects}


@kernel()
def _by_boundaries(
    field: F32, rate: F32, overlap: Mask, corner: F64, cell_m: float, pose: F64, asked: F64, low: F64, high: F64,
    barrier: Barrier,
) -> tuple[float, float, F64, F64, float, float, bool]:  # fmt: skip
    """Return the fields of an `Answer`: the samples and the velocity in one call, so that no array is boxed in between."""
    normal, distance, recede, enclosed = boundary_samples(
        field, rate, overlap, corner, cell_m, pose[:2], barrier.sample_radius_m, 2.0 * barrier.safe_m, barrier.directions
    )
    answer: tuple[float, float, F64, F64, float, float, bool] = filter_velocity(
        normal, distance, recede, enclosed, pose, asked, low, high, barrier
    )
    return answer


@kernel()
def _by_own_gradient(
    field: F32, rate: F32, overlap: Mask, corner: F64, cell_m: float, pose: F64, asked: F64, low: F64, high: F64,
    barrier: Barrier,
) -> tuple[float, float, F64, F64, float, float, bool]:  # fmt: skip
    normal, distance, recede, enclosed = own_gradient(field, rate, overlap, corner, cell_m, pose[:2])
    answer: tuple[float, float, F64, F64, float, float, bool] = filter_velocity(
        normal, distance, recede, enclosed, pose, asked, low, high, barrier
    )
    return answer


def _pose(belief: Belief) -> F64:
    pose = belief.odom_from_base
    return np.array([pose.x, pose.y, pose.yaw])
