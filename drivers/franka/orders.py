"""A joint trajectory as the numbers of an order to the process at the wire, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.arm_motion import JOINTS
from drivers.interface.commands import JointTrajectory

F64 = NDArray[np.float64]
MOST_KNOTS = 256
_HEAD = 2  # start [ns] on CLOCK_MONOTONIC, exact up to 2^53 ns after boot; speed factor
_KNOT = 1 + 2 * JOINTS
CAPACITY = _HEAD + MOST_KNOTS * _KNOT


def packed(trajectory: JointTrajectory, start_ns: int) -> F64:
    """Return an order, at most (CAPACITY,) numbers, to follow a trajectory that starts at a time of CLOCK_MONOTONIC."""
    head = np.array([float(start_ns), trajectory.speed_factor])
    knots = (trajectory.time_from_start_s, trajectory.position_rad.ravel(), trajectory.velocity_rad_s.ravel())
    return np.concatenate((head, *knots))


def unpacked(order: F64) -> JointTrajectory:
    """Return the trajectory; its start is on CLOCK_MONOTONIC.

    >>> unpacked(packed(JointTrajectory.rest(), 5)).is_rest
    True
    """
    knots = (len(order) - _HEAD) // _KNOT
    time_s, position, velocity = np.split(order[_HEAD:], (knots, knots * (1 + JOINTS)))
    shape = (knots, JOINTS)
    return JointTrajectory(int(order[0]), time_s, position.reshape(shape), velocity.reshape(shape), float(order[1]))
