"""The point attractor's velocity; numbers in, numbers out."""

from __future__ import annotations

import numpy as np

from drivers.interface.kernel import kernel


@kernel()
def attraction(x: float, y: float, gain_per_s: float, speed_m_s: float) -> tuple[float, float]:
    """Return the velocity towards an attractor at (x, y) from the robot [m], in the same frame, at most `speed_m_s` [m/s].

    Source: Cui, Deng, Wang, equation 4, with the manifold shrunk to a point: what is left is the attraction.

    >>> attraction(10.0, 0.0, 1.0, 0.5)
    (0.5, 0.0)
    >>> attraction(0.0, -0.25, 1.0, 0.5)
    (0.0, -0.25)
    """
    distance = np.hypot(x, y)
    gain = min(gain_per_s, speed_m_s / distance) if distance > 0.0 else 0.0
    return gain * x, gain * y


@kernel()
def within(vx: float, vy: float, low_x: float, high_x: float, high_y: float) -> tuple[float, float]:
    """Return the velocity shrunk, direction kept, until low_x <= vx <= high_x and |vy| <= high_y [m/s]; low_x <= 0.

    >>> within(0.5, -1.0, -0.75, 0.75, 0.5)
    (0.25, -0.5)
    """
    share = 1.0
    if vx > high_x:
        share = min(share, high_x / vx)
    if vx < low_x:
        share = min(share, low_x / vx)
    if abs(vy) > high_y:
        share = min(share, high_y / abs(vy))
    return share * vx, share * vy
