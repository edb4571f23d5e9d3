"""What the robot believes: where it is, how it moves, what is free around it, and how that changes."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.samples import JointSample

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]
Mask = NDArray[np.bool_]

# Cell labels, with the values of a ROS OccupancyGrid (which writes unknown as -1, the same byte).
FREE, OCCUPIED, UNKNOWN = 0, 100, 255


@dataclass(frozen=True, slots=True)
class Lattice:
    """Where a grid lies: square cells, rows along y and columns along x of odom.

    Cell (row, column) covers x in [x_m + column * cell_m, + cell_m) and y likewise; corners are whole multiples of cell_m, so
    that two lattices of the same cell size always coincide cell by cell.
    """

    x_m: float  # lower corner of cell (0, 0) in odom
    y_m: float
    cell_m: float
    rows: int
    columns: int

    def cell_of(self, points: F64) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return rows and columns, each shape (n,), of points in odom, shape (n, 2); may lie outside."""
        columns = np.floor((points[:, 0] - self.x_m) / self.cell_m).astype(np.intp)
        rows = np.floor((points[:, 1] - self.y_m) / self.cell_m).astype(np.intp)
        return rows, columns

    def centres(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> F64:
        """Return the cells' centres in odom, shape (n, 2) [m]."""
        return np.stack((self.x_m + (columns + 0.5) * self.cell_m, self.y_m + (rows + 0.5) * self.cell_m), axis=-1)


@dataclass(frozen=True, slots=True)
class OccupancyGrid:
    """Labels FREE, OCCUPIED and UNKNOWN around the robot, in odom."""

    lattice: Lattice
    label: U8  # (rows, columns)


@dataclass(frozen=True, slots=True)
class ClearanceField:
    """Distance to the nearest occupied cell, and how it changes, in odom (ego-motion is thereby compensated).

    Source: Cui, Deng, Wang, section 4.1, equation 1.  The rate is zero outside `overlap`, the cells known now and at the
    frame before.
    """

    lattice: Lattice
    clearance_m: F32  # (rows, columns); 0 in occupied cells
    rate_m_s: F32  # (rows, columns)
    known: Mask  # (rows, columns)
    overlap: Mask  # (rows, columns)


@dataclass(frozen=True, slots=True)
class Track:
    """A moving obstacle without a class: a disc with a velocity."""

    identity: int
    position_in_odom: tuple[float, float]
    velocity_in_odom: tuple[float, float]  # m/s
    radius_m: float
    covariance: F64  # (4, 4): x, y [m], vx, vy [m/s]


@dataclass(frozen=True, slots=True)
class Registration:
    """What the newest frame, laid on the map, gave; along `undetermined` it gave nothing, as along a corridor."""

    captured_ns: int
    points: int  # of the frame that lay on what the map knows
    residual_m: float  # RMS of their distances
    correction: SE2  # of the pose expected from odometry: x, y along map, yaw
    covariance: F64  # (3, 3) of map_from_base then: x, y [m], yaw [rad]
    undetermined: F64  # (k, 3), orthonormal directions of x, y [m] in map and yaw [rad]; all three where nothing matched


class EstimatorFault(enum.Enum):
    """What an estimator finds wrong with itself or with what it was given."""

    DIVERGED = "estimator diverged"
    INVALID_INPUT = "invalid values in a sample"


@dataclass(frozen=True, slots=True)
class Belief:
    """The estimate at one tick."""

    tick: int
    stamp_ns: int
    odom_from_base: SE2
    map_from_odom: SE2
    twist: BodyTwist
    covariance: F64  # (3, 3) of odom_from_base: x, y [m], yaw [rad]
    grid: OccupancyGrid
    clearance: ClearanceField
    tracks: tuple[Track, ...]
    joints: JointSample | None
    oldest_input_ns: int  # capture time of the oldest among each device's newest samples
    faults: tuple[EstimatorFault, ...] = ()
    registration: Registration | None = None  # None: it is off, or no frame came yet

    @property
    def map_from_base(self) -> SE2:
        """Where the robot believes it is in the map."""
        return self.map_from_odom @ self.odom_from_base
