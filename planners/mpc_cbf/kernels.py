"""The unicycle over a step, its linearisation, and barriers along a trajectory; arrays in, arrays out.

Source of the barriers: Zeng, Zhang, Sreenath, Safety-critical model predictive control with discrete-time control barrier
function, ACC 2021, section III.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F64 = NDArray[np.float64]


@kernel()
def rollout(state: F64, inputs: F64, step_s: float) -> F64:
    """Return the states x, y, yaw, shape (n + 1, 3), from the first, shape (3,), under speed and rate, shape (n, 2).

    Each step drives straight along the heading in its middle, which errs in the third order of the angle turned.
    """
    states = np.empty((len(inputs) + 1, 3))
    states[0] = state
    for k in range(len(inputs)):
        middle, length = states[k, 2] + 0.5 * step_s * inputs[k, 1], inputs[k, 0] * step_s
        states[k + 1, 0] = states[k, 0] + length * np.cos(middle)
        states[k + 1, 1] = states[k, 1] + length * np.sin(middle)
        states[k + 1, 2] = states[k, 2] + step_s * inputs[k, 1]
    return states


@kernel()
def linearised(states: F64, inputs: F64, step_s: float) -> F64:
    """Return the derivatives of each step that are neither 0 nor 1, shape (n, 7).

    They are dx/dyaw, dy/dyaw, dx/dv, dx/dw, dy/dv, dy/dw, dyaw/dw of the state after the step.
    """
    slopes = np.empty((len(inputs), 7))
    for k in range(len(inputs)):
        middle, length = states[k, 2] + 0.5 * step_s * inputs[k, 1], inputs[k, 0] * step_s
        c, s = np.cos(middle), np.sin(middle)
        slopes[k, 0], slopes[k, 1] = -length * s, length * c
        slopes[k, 2], slopes[k, 3] = step_s * c, -0.5 * step_s * length * s
        slopes[k, 4], slopes[k, 5] = step_s * s, 0.5 * step_s * length * c
        slopes[k, 6] = step_s
    return slopes


@kernel()
def barriers(states: F64, centre: F64, velocity: F64, radius_m: F64, step_s: float) -> tuple[F64, F64]:
    """Return h = |p - o| - r, shape (n + 1, m) [m], and its gradient, shape (n + 1, m, 2), for m discs that move on.

    At a disc's centre, where there is no gradient, it points back along the heading.
    """
    value, gradient = np.empty((len(states), len(centre))), np.empty((len(states), len(centre), 2))
    for k in range(len(states)):
        for i in range(len(centre)):
            dx = states[k, 0] - centre[i, 0] - k * step_s * velocity[i, 0]
            dy = states[k, 1] - centre[i, 1] - k * step_s * velocity[i, 1]
            apart = np.hypot(dx, dy)
            value[k, i] = apart - radius_m[i]
            if apart > 1e-6:
                gradient[k, i, 0], gradient[k, i, 1] = dx / apart, dy / apart
            else:
                gradient[k, i, 0], gradient[k, i, 1] = -np.cos(states[k, 2]), -np.sin(states[k, 2])
    return value, gradient


@kernel()
def fall(value: F64, gamma: float) -> F64:
    """Return by how much each barrier falls below what it may at each step, shape (n, m) [m]; negative when it does not.

    The condition of the paper is h(k + 1) >= (1 - gamma) h(k).
    """
    missing = np.empty((len(value) - 1, value.shape[1]))
    for k in range(len(value) - 1):
        for i in range(value.shape[1]):
            missing[k, i] = (1.0 - gamma) * value[k, i] - value[k + 1, i]
    return missing
