"""The motion model of the odometry's Kalman filter: what the inertial unit says of the next moment.

The state holds the pose, the body velocity, the biases, and the way made since the last wheel sample in the base frame of
that sample.  Wheels measure just this way, however long ago their last sample was (stochastic cloning: Roumeliotis, Burdick,
ICRA 2002; the way is the clone's difference, so that the measurement is linear).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from estimators.belief import F64

STATES = 11
X, Y, YAW, VX, VY, GYRO_BIAS, AX_BIAS, AY_BIAS, WAY_X, WAY_Y, WAY_YAW = range(STATES)
POSE, VELOCITY, WAY = slice(X, VX), slice(VX, GYRO_BIAS), slice(WAY_X, STATES)
BIASES, FORCE_BIASES = slice(GYRO_BIAS, WAY_X), slice(AX_BIAS, WAY_X)
_BIAS_DIAGONAL = ((GYRO_BIAS, AX_BIAS, AY_BIAS), (GYRO_BIAS, AX_BIAS, AY_BIAS))


@dataclass(frozen=True, slots=True)
class Inertial:
    """What drives the prediction over a time: yaw rate and specific force, biases not yet taken off."""

    rate_rad_s: float
    force_x_m_s2: float | None  # None: not measured; the velocity is taken to stay
    force_y_m_s2: float
    rate_std: float  # rad/s/sqrt(Hz)
    force_std: float  # m/s^2/sqrt(Hz)


def moved(x: F64, inertial: Inertial, dt_s: float) -> tuple[F64, F64]:
    """Return the state after a time, shape (11,), and its Jacobian, shape (11, 11).

    Along the chord at the heading halfway, with the mean of the velocities at both ends; rates of change in the turning
    base frame (dv/dt = f - w x v).
    """
    px, py, yaw, vx, vy, gyro_bias, ax_bias, ay_bias, wx, wy, wyaw = x.tolist()
    w = inertial.rate_rad_s - gyro_bias
    measured = inertial.force_x_m_s2 is not None
    ax = (inertial.force_x_m_s2 or 0.0) - ax_bias if measured else -w * vy
    ay = inertial.force_y_m_s2 - ay_bias if measured else w * vx
    vx_end, vy_end = vx + (ax + w * vy) * dt_s, vy + (ay - w * vx) * dt_s
    ux, uy = 0.5 * (vx + vx_end) * dt_s, 0.5 * (vy + vy_end) * dt_s
    turned = w * dt_s
    after, jacobian = np.empty(STATES), np.eye(STATES)
    after[:] = px, py, yaw + turned, vx_end, vy_end, gyro_bias, ax_bias, ay_bias, wx, wy, wyaw + turned
    for first, heading in ((X, yaw), (WAY_X, wyaw)):
        c, s = math.cos(heading + 0.5 * turned), math.sin(heading + 0.5 * turned)
        dx, dy = c * ux - s * uy, s * ux + c * uy
        after[first] += dx
        after[first + 1] += dy
        jacobian[first, first + 2], jacobian[first + 1, first + 2] = -dy, dx
        jacobian[first, GYRO_BIAS], jacobian[first + 1, GYRO_BIAS] = 0.5 * dt_s * dy, -0.5 * dt_s * dx
        jacobian[first, VX], jacobian[first, VY] = c * dt_s, -s * dt_s
        jacobian[first + 1, VX], jacobian[first + 1, VY] = s * dt_s, c * dt_s
        half = 0.5 * dt_s * dt_s
        jacobian[first, AX_BIAS], jacobian[first, AY_BIAS] = -c * half, s * half
        jacobian[first + 1, AX_BIAS], jacobian[first + 1, AY_BIAS] = -s * half, -c * half
        jacobian[first + 2, GYRO_BIAS] = -dt_s
    jacobian[VX, AX_BIAS] = jacobian[VY, AY_BIAS] = -dt_s
    if measured:
        jacobian[VX, VY], jacobian[VY, VX] = turned, -turned
        jacobian[VX, GYRO_BIAS], jacobian[VY, GYRO_BIAS] = -vy * dt_s, vx * dt_s
    return after, jacobian


def transition(x: F64, inertial: Inertial, walk_std: F64, dt_s: float) -> tuple[F64, F64, F64]:
    """Return the state after a time, the transition matrix and the covariance that the time adds: (11,), (11, 11), (11, 11).

    Noise of gyro and accelerometer enters where their biases do; `walk_std`, shape (3,), are the random walks of the biases.
    """
    after, jacobian = moved(x, inertial, dt_s)
    root = math.sqrt(dt_s)
    entry = jacobian[:, BIASES] * (inertial.rate_std / root, inertial.force_std / root, inertial.force_std / root)  # (11, 3)
    entry[BIASES] = 0.0
    noise = entry @ entry.T
    noise[_BIAS_DIAGONAL] = walk_std * walk_std * dt_s
    if inertial.force_x_m_s2 is None:
        jacobian[:AX_BIAS, FORCE_BIASES] = jacobian[WAY, FORCE_BIASES] = 0.0
    return after, jacobian, noise
