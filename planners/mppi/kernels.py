"""Sampling, rolling out and averaging control sequences; arrays in, arrays out.

Source: Williams, Drews, Goldfain, Rehg, Theodorou, Information-theoretic model predictive control: theory and applications to
autonomous driving, IEEE T-RO 2018, algorithm 2, in the form of nav2_mppi_controller.  The trajectory's index comes last, so
that the inner loops are vectorised over trajectories.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F32 = NDArray[np.float32]


@kernel(fast=True)
def sample_controls(sequence: F32, noise: F32, now: F32, reach: F32, controls: F32) -> None:
    """Write to `controls`, shape (3, steps, batch), the sequence, shape (3, steps), with noise of the same shape added.

    No step changes a velocity by more than `reach`, shape (3,); the first one starts from `now`, shape (3,).
    """
    axes, steps, batch = controls.shape
    for axis in range(axes):
        least, most = now[axis] - reach[axis], now[axis] + reach[axis]
        for b in range(batch):
            controls[axis, 0, b] = min(max(sequence[axis, 0] + noise[axis, 0, b], least), most)
        for k in range(1, steps):
            for b in range(batch):
                before = controls[axis, k - 1, b]
                wanted = sequence[axis, k] + noise[axis, k, b]
                controls[axis, k, b] = min(max(wanted, before - reach[axis]), before + reach[axis])


@kernel(fast=True)
def roll_out(controls: F32, pose: F32, dt: np.float32, x: F32, y: F32, yaw: F32) -> None:
    """Write where the controls, shape (3, steps, batch), lead from a pose, shape (3,): x, y, yaw, each shape (steps, batch).

    The robot moves straight along its mean heading of a step.  Heading is carried as a vector that is turned by an angle so
    small that the sine's first terms are exact to single precision.
    """
    steps, batch = x.shape
    cosine, sine = np.full(batch, np.cos(pose[2]), np.float32), np.full(batch, np.sin(pose[2]), np.float32)
    for k in range(steps):
        for b in range(batch):
            half = np.float32(0.5) * controls[2, k, b] * dt
            squared = half * half
            s = half * (np.float32(1.0) - squared * (np.float32(1.0 / 6.0) - squared * np.float32(1.0 / 120.0)))
            c = np.float32(1.0) - squared * (np.float32(0.5) - squared * np.float32(1.0 / 24.0))
            cx, sx = c * cosine[b] - s * sine[b], s * cosine[b] + c * sine[b]
            before_x = x[k - 1, b] if k > 0 else pose[0]
            before_y = y[k - 1, b] if k > 0 else pose[1]
            before_yaw = yaw[k - 1, b] if k > 0 else pose[2]
            x[k, b] = before_x + dt * (controls[0, k, b] * cx - controls[1, k, b] * sx)
            y[k, b] = before_y + dt * (controls[0, k, b] * sx + controls[1, k, b] * cx)
            yaw[k, b] = before_yaw + np.float32(2.0) * half
            cosine[b], sine[b] = c * cx - s * sx, s * cx + c * sx


@kernel(fast=True)
def charge_change(controls: F32, sequence: F32, price: F32, costs: F32) -> None:
    """Add to the costs, shape (batch,), what leaving the sequence, shape (3, steps), costs at `price`, shape (3,).

    It is the term gamma u^T Sigma^-1 (v - u) of the importance weights; `price` is gamma / sigma^2 per axis.
    """
    axes, steps, batch = controls.shape
    for axis in range(axes):
        for k in range(steps):
            u = sequence[axis, k]
            factor = price[axis] * u
            for b in range(batch):
                costs[b] += factor * (controls[axis, k, b] - u)


@kernel()
def average(controls: F32, costs: F32, temperature: float) -> tuple[F32, float]:
    """Return the mean of the controls weighted by exp(-cost / temperature), shape (3, steps), and the effective sample size."""
    axes, steps, batch = controls.shape
    lowest = costs.min()
    weights = np.empty(batch)
    total, squares = 0.0, 0.0
    for b in range(batch):
        weights[b] = np.exp(-(costs[b] - lowest) / temperature)
        total += weights[b]
        squares += weights[b] * weights[b]
    mean = np.empty((axes, steps), np.float32)
    for axis in range(axes):
        for k in range(steps):
            weighted = 0.0
            for b in range(batch):
                weighted += weights[b] * controls[axis, k, b]
            mean[axis, k] = weighted / total
    return mean, total * total / squares


@kernel()
def limit(sequence: F32, now: F32, reach: F32, lowest: F32, highest: F32) -> None:
    """Keep a sequence, shape (3, steps), inside the caps and accelerations, each shape (3,), in place."""
    axes, steps = sequence.shape
    for axis in range(axes):
        before = now[axis]
        for k in range(steps):
            wanted = min(max(sequence[axis, k], before - reach[axis]), before + reach[axis])
            before = sequence[axis, k] = min(max(wanted, lowest[axis]), highest[axis])
