"""The smooth control law, its simulation and the choice of a target that it reaches; arrays in, arrays out.

Source: Park, Kuipers, A smooth control law for graceful motion of differential wheeled mobile robots in 2D environment,
ICRA 2011, equations 13 to 15.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.field_query import bilinear

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]


class Law(NamedTuple):
    """Constants of the control law and of a turn on the spot."""

    k_phi: float
    k_delta: float
    beta: float
    exponent: float
    slowdown_m: float
    slowest_m_s: float
    fastest_m_s: float
    turn_rad_s: float  # the most
    least_turn_rad_s: float  # of a turn on the spot
    rotation_gain: float
    rotate_beyond_rad: float  # a target this far aside is turned to on the spot first


class Field(NamedTuple):
    """Where there is room; lengths in metres, odom frame."""

    clearance: F32  # (rows, columns)
    corner_x: float
    corner_y: float
    cell_m: float
    required_m: float  # least clearance of the robot's centre


@kernel()
def wrapped(angle: float) -> float:
    """Return the angle in [-pi, pi)."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


@kernel()
def curvature_of(distance_m: float, phi: float, delta: float, k_phi: float, k_delta: float) -> float:
    """Return the curvature [1/m] of equation 13; `phi` (the paper's theta) is the target's heading and `delta` the robot's.

    Both are taken from the line of sight to the target.
    """
    steering = k_delta * (delta - np.arctan(-k_phi * phi))
    return float(-(steering + (1.0 + k_phi / (1.0 + (k_phi * phi) ** 2)) * np.sin(delta)) / distance_m)


@kernel()
def smooth(pose: F64, target: F64, law: Law) -> tuple[float, float]:
    """Return speed [m/s] and turn [rad/s] from a pose towards a target pose, both (3,) (equations 14 and 15).

    The speed falls with the curvature and near the target; a curve that asks for too fast a turn is driven slower.
    """
    dx, dy = target[0] - pose[0], target[1] - pose[1]
    distance = max(np.hypot(dx, dy), 1e-6)
    sight = np.arctan2(dy, dx)
    curvature = curvature_of(distance, wrapped(target[2] - sight), wrapped(pose[2] - sight), law.k_phi, law.k_delta)
    speed = law.fastest_m_s / (1.0 + law.beta * abs(curvature) ** law.exponent)
    speed = min(speed, law.fastest_m_s * distance / law.slowdown_m)
    speed = min(max(speed, law.slowest_m_s), law.fastest_m_s)
    turn = min(max(curvature * speed, -law.turn_rad_s), law.turn_rad_s)
    return (turn / curvature if curvature != 0.0 else speed), turn


@kernel()
def rotation(angle_rad: float, law: Law) -> float:
    """Return the turn on the spot [rad/s] by an angle: in proportion, but no slower than the base turns smoothly."""
    rate = min(max(law.rotation_gain * abs(angle_rad) * law.turn_rad_s, law.least_turn_rad_s), law.turn_rad_s)
    return float(np.copysign(rate, angle_rad))


@kernel()
def simulate(pose: F64, target: F64, law: Law, field: Field, way: F64) -> tuple[int, float, float]:
    """Follow the law from a pose to a target pose, both (3,), and write the poses to `way`, shape (n, 3).

    A step is the time of a cell at full speed; there are at most three a cell of the distance, which is as far as a robot
    that first turns or slows down is looked after.  Returns the number of poses written (0: it collides), and speed and turn
    at the start.
    """
    dt = field.cell_m / law.fastest_m_s
    steps = min(len(way), 1 + int(3.0 * np.hypot(target[0] - pose[0], target[1] - pose[1]) / field.cell_m))
    x, y, yaw = pose[0], pose[1], pose[2]
    bearing = np.arctan2(target[1] - y, target[0] - x)
    rotating = abs(wrapped(bearing - yaw)) > law.rotate_beyond_rad
    first_speed, first_turn = 0.0, 0.0
    now = np.empty(3)
    for k in range(steps):
        now[:] = x, y, yaw
        if rotating:
            speed, turn = 0.0, rotation(wrapped(bearing - yaw), law)
            rotating = abs(wrapped(bearing - yaw - turn * dt)) > law.rotate_beyond_rad
        else:
            speed, turn = smooth(now, target, law)
        if k == 0:
            first_speed, first_turn = speed, turn
        x, y = x + speed * dt * np.cos(yaw + 0.5 * turn * dt), y + speed * dt * np.sin(yaw + 0.5 * turn * dt)
        yaw += turn * dt
        way[k] = x, y, yaw
        if bilinear(field.clearance, field.corner_x, field.corner_y, field.cell_m, x, y) < field.required_m:
            return 0, 0.0, 0.0
        if np.hypot(target[0] - x, target[1] - y) <= field.cell_m:
            return k + 1, first_speed, first_turn
    return steps, first_speed, first_turn


@kernel()
def choose(pose: F64, targets: F64, aim: bool, law: Law, field: Field, nearest: int, way: F64) -> tuple[int, int, float, float]:
    """Return the farthest target of those, shape (n, 3), that the law reaches without collision; -1 when it reaches none.

    With it, how many poses of `way`, shape (m, 3), its simulation filled, and speed and turn to drive now.  With `aim`, a
    target is first tried with the heading of the line of sight to it.  Targets before `nearest` are not tried.
    """
    sighted = np.empty(3)
    for i in range(len(targets) - 1, nearest - 1, -1):
        if aim:
            sighted[:] = targets[i]
            sighted[2] = np.arctan2(targets[i, 1] - pose[1], targets[i, 0] - pose[0])
            count, speed, turn = simulate(pose, sighted, law, field, way)
            if count > 0:
                return i, count, speed, turn
        count, speed, turn = simulate(pose, targets[i], law, field, way)
        if count > 0:
            return i, count, speed, turn
    return -1, 0, 0.0, 0.0
