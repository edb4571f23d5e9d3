"""What devices deliver.  A sample says when it was captured, when it was received, and on which clock it was stamped.

All samples are immutable; their arrays are marked read-only by `frozen_array` and are never shared with a device's buffer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2, SE3
from drivers.interface.mission import Goal

F64 = NDArray[np.float64]
U16 = NDArray[np.uint16]
A = TypeVar("A", bound=NDArray[Any])


def frozen_array(array: A) -> A:
    """Return the array after marking it read-only."""
    array.flags.writeable = False
    return array


@dataclass(frozen=True, slots=True)
class Stamp:
    """When a sample was taken [ns], and when our side received it (the loop's clock).

    `captured_ns` is on the loop's clock as well: a driver whose device has a clock of its own converts, and names that clock.
    `sequence` counts every sample that was taken, also those that got lost: a gap is a loss.
    """

    captured_ns: int
    received_ns: int
    sequence: int
    clock: str = "host"


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """Pinhole intrinsics [pixels] of a rectified image."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float


@dataclass(frozen=True, slots=True)
class DepthFrame:
    """One depth image.  A depth of 0 means the camera does not know (it never means far)."""

    stamp: Stamp
    depth: U16  # (height, width), in units of depth_unit_m
    depth_unit_m: float
    intrinsics: Intrinsics
    base_from_optical: SE3


@dataclass(frozen=True, slots=True)
class ColourFrame:
    """A JPEG picture for the human eye; nothing in the loop reads it."""

    stamp: Stamp
    jpeg: bytes


@dataclass(frozen=True, slots=True)
class MarkerSample:
    """The fiducial markers in one camera image: what was detected, not the image; none seen is a sample too."""

    stamp: Stamp
    ids: tuple[int, ...]  # (n,)
    corners_px: F64  # (n, 4, 2): of the black square, clockwise from its top left as printed; pixel centres are whole numbers
    intrinsics: Intrinsics
    base_from_optical: SE3


@dataclass(frozen=True, slots=True)
class ImuSample:
    """Body rates and specific force in the base frame."""

    stamp: Stamp
    gyro_rad_s: tuple[float, float, float]
    accel_m_s2: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class WheelSample:
    """Wheel angles and rates, in the order of the base's kinematics."""

    stamp: Stamp
    position_rad: F64  # (wheels,)
    velocity_rad_s: F64  # (wheels,)


@dataclass(frozen=True, slots=True)
class PoseSample:
    """An absolute pose that a device offers (an autopilot's local position, a motion-capture system)."""

    stamp: Stamp
    local_from_base: SE2
    twist: BodyTwist | None
    covariance: F64  # (3, 3): x, y [m], yaw [rad]


@dataclass(frozen=True, slots=True)
class JointSample:
    """An arm's joint state."""

    stamp: Stamp
    position_rad: F64  # (joints,)
    velocity_rad_s: F64  # (joints,)
    torque_nm: F64  # (joints,)


@dataclass(frozen=True, slots=True)
class RangeScan:
    """A planar range scan in the base frame; no return is `inf`, an invalid one NaN."""

    stamp: Stamp
    angle_min_rad: float
    angle_step_rad: float
    range_m: F64  # (beams,)
    range_max_m: float


@dataclass(frozen=True, slots=True)
class ObstacleTruth:
    """Where an obstacle really is: its pose in the map, its velocity there and its bounding radius."""

    name: str
    map_from_obstacle: SE2
    velocity_m_s: tuple[float, float]
    radius_m: float


@dataclass(frozen=True, slots=True)
class TruthSample:
    """Ground truth, for evaluation; the loop reads it only where the configuration says so."""

    stamp: Stamp
    map_from_base: SE2
    twist: BodyTwist
    obstacles: tuple[ObstacleTruth, ...]
    clearance_m: float  # signed, surface to surface, to the nearest obstacle
    contacts: tuple[str, ...]  # names of what the robot touches now


def merged_truth(looks: Sequence[TruthSample]) -> TruthSample:
    """Return the newest of some looks with the least clearance and all contacts of them, so that no short touch is missed."""
    contacts = sorted({name for look in looks for name in look.contacts})
    return replace(looks[-1], clearance_m=min(look.clearance_m for look in looks), contacts=tuple(contacts))


@dataclass(frozen=True, slots=True)
class SetEnabled:
    """The operator gives or takes the permission to move."""

    enabled: bool


@dataclass(frozen=True, slots=True)
class EmergencyStop:
    """The operator's e-stop; latched until `ResetFaults`."""


@dataclass(frozen=True, slots=True)
class ResetFaults:
    """The operator clears latched faults."""


@dataclass(frozen=True, slots=True)
class SetPaused:
    """The operator pauses the mission (the robot stands) or resumes it."""

    paused: bool


@dataclass(frozen=True, slots=True)
class Jog:
    """The operator drives by hand; valid until `expires_ns`, the shield stays on."""

    twist: BodyTwist
    expires_ns: int


@dataclass(frozen=True, slots=True)
class NewGoal:
    """The operator sends the robot somewhere else."""

    goal: Goal


OperatorAction = SetEnabled | EmergencyStop | ResetFaults | SetPaused | Jog | NewGoal


@dataclass(frozen=True, slots=True)
class OperatorEvent:
    """One action of the operator, with its time."""

    stamp: Stamp
    action: OperatorAction


BaseSample = WheelSample | PoseSample
