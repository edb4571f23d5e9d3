"""The dynamic window: the velocities that the base can have soon."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BaseLimits, BodyTwist

F64 = NDArray[np.float64]


def _axis(now: float, cap: tuple[float, float], reach: float, count: int) -> F64:
    """Return `count` velocities of one axis, shape (count,); the one nearest to zero is zero where zero can be reached."""
    lowest, highest = min(max(cap[0], now - reach), cap[1]), max(min(cap[1], now + reach), cap[0])
    values = np.linspace(lowest, highest, count)
    if values[0] <= 0.0 <= values[-1]:
        values[np.argmin(np.abs(values))] = 0.0
    return values


def dynamic_window(now: BodyTwist, limits: BaseLimits, window_s: float, counts: tuple[int, int, int], max_speed: float) -> F64:
    """Return the twists to try, shape (n, 3) [m/s, m/s, rad/s].

    Source: Fox, Burgard, Thrun 1997, section III-B: the velocities inside the caps that the accelerations reach within
    `window_s`.  A speed above `max_speed` is left out, unless the base is so fast already that nothing else would be left.
    """
    cap, acceleration = limits.velocity, limits.acceleration
    fastest = min(cap.vx, max_speed)  # a sample of its own, else the speed hunts between its neighbours
    vx = _axis(now.vx, (-fastest if limits.reverse else 0.0, fastest), acceleration.vx * window_s, counts[0])
    vy = _axis(now.vy, (-cap.vy, cap.vy), acceleration.vy * window_s, counts[1]) if limits.holonomic else np.zeros(1)
    wz = _axis(now.wz, (-cap.wz, cap.wz), acceleration.wz * window_s, counts[2])
    grid = np.stack(np.meshgrid(vx, vy, wz, indexing="ij"), axis=-1).reshape(-1, 3)
    slow = np.hypot(grid[:, 0], grid[:, 1]) <= max_speed + 1e-9
    return np.ascontiguousarray(grid[slow] if slow.any() else grid)
