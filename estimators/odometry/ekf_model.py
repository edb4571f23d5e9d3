"""The motion model of the odometry's Kalman filter: what the inertial unit says of the next moment.

The state holds the pose, the body velocity, the biases, and the way made since the last wheel sample in the base frame of
that sample.  Wheels measure just this way, however long ago their last sample was (stochastic cloning: Roumeliotis, Burdick,
ICRA 2002; the way is the clone's difference, so that the measurement is linear).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from drivers.interface.kernel import kernel
from estimators.belief import F64

STATES = 11
X, Y, YAW, VX, VY, GYRO_BIAS, AX_BIAS, AY_BIAS, WAY_X, WAY_Y, WAY_YAW = range(STATES)
POSE, VELOCITY, WAY = slice(X, VX), slice(VX, GYRO_BIAS), slice(WAY_X, STATES)
BIASES = slice(GYRO_BIAS, WAY_X)


Drive = tuple[float, float, float, bool, float, float]


class Inertial(NamedTuple):
    """What drives the prediction over a time: yaw rate and specific force, biases not yet taken off."""

    rate_rad_s: float
    force_x_m_s2: float
    force_y_m_s2: float
    force_is_known: bool  # else the velocity is taken to stay
    rate_std: float  # rad/s/sqrt(Hz)
    force_std: float  # m/s^2/sqrt(Hz)


@kernel()
def moved(x: F64, inertial: Inertial, dt_s: float) -> tuple[F64, F64]:
    """Return the state after a time, shape (11,), and its Jacobian, shape (11, 11).

    Along the chord at the heading halfway, with the mean of the velocities at both ends; rates of change in the turning
    base frame (dv/dt = f - w x v).  The columns of the biases are there also where no force is known: noise enters by them.
    """
    vx, vy, w = x[VX], x[VY], inertial.rate_rad_s - x[GYRO_BIAS]
    turned, half = w * dt_s, 0.5 * dt_s * dt_s
    after, jacobian = x.copy(), np.eye(STATES)
    if inertial.force_is_known:
        after[VX] = vx + (inertial.force_x_m_s2 - x[AX_BIAS] + w * vy) * dt_s
        after[VY] = vy + (inertial.force_y_m_s2 - x[AY_BIAS] - w * vx) * dt_s
        jacobian[VX, VY], jacobian[VY, VX] = turned, -turned
        jacobian[VX, GYRO_BIAS], jacobian[VY, GYRO_BIAS] = -vy * dt_s, vx * dt_s
    jacobian[VX, AX_BIAS] = jacobian[VY, AY_BIAS] = -dt_s
    ux, uy = 0.5 * (vx + after[VX]) * dt_s, 0.5 * (vy + after[VY]) * dt_s
    for i in (X, WAY_X):
        c, s = math.cos(x[i + 2] + 0.5 * turned), math.sin(x[i + 2] + 0.5 * turned)
        dx, dy = c * ux - s * uy, s * ux + c * uy
        after[i], after[i + 1], after[i + 2] = x[i] + dx, x[i + 1] + dy, x[i + 2] + turned
        jacobian[i, i + 2], jacobian[i + 1, i + 2] = -dy, dx
        jacobian[i, VX], jacobian[i, VY], jacobian[i + 1, VX], jacobian[i + 1, VY] = c * dt_s, -s * dt_s, s * dt_s, c * dt_s
        jacobian[i, GYRO_BIAS], jacobian[i + 1, GYRO_BIAS] = 0.5 * dt_s * dy, -0.5 * dt_s * dx
        jacobian[i + 2, GYRO_BIAS] = -dt_s
        jacobian[i, AX_BIAS], jacobian[i, AY_BIAS] = -c * half, s * half
        jacobian[i + 1, AX_BIAS], jacobian[i + 1, AY_BIAS] = -s * half, -c * half
    return after, jacobian


@kernel()
def transition(x: F64, drive: Drive, walk_std: F64, dt_s: float) -> tuple[F64, F64, F64]:
    """Return the state after a time, the transition matrix and the covariance that the time adds: (11,), (11, 11), (11, 11).

    `drive` holds the fields of an `Inertial`: a plain tuple enters a compiled function in half the time of a named one.  Noise of
    gyro and accelerometer enters where their biases do; `walk_std`, shape (3,), are the random walks of the biases.
    """
    inertial = Inertial(*drive)
    after, jacobian = moved(x, inertial, dt_s)
    noise = np.zeros((STATES, STATES))
    for k in range(3):
        bias = GYRO_BIAS + k
        density = inertial.rate_std if k == 0 else inertial.force_std
        entry = jacobian[:, bias].copy()
        entry[bias] = 0.0
        noise += np.outer(entry, entry) * (density * density / dt_s)
        noise[bias, bias] += walk_std[k] * walk_std[k] * dt_s
        if k > 0 and not inertial.force_is_known:
            jacobian[:, bias] = 0.0
            jacobian[bias, bias] = 1.0
    return after, jacobian, noise


@kernel()
def without_way(x: F64, covariance: F64) -> tuple[F64, F64]:
    """Return state and covariance with a way that begins here, certain to be none: (11,), (11, 11)."""
    x, covariance = x.copy(), covariance.copy()
    x[WAY_X:] = 0.0
    covariance[WAY_X:, :] = 0.0
    covariance[:, WAY_X:] = 0.0
    return x, covariance
