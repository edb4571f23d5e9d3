"""The half-planes of velocities that keep clear of agents and of what stands; arrays in, arrays out.

Source: van den Berg, Guy, Lin, Manocha, Reciprocal n-body collision avoidance, ISRR 2009 (Springer 2011), section 4 and 5.3.
A half-plane holds the velocities v with normal . v >= bound.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F64 = NDArray[np.float64]


@kernel()
def way_out(px: float, py: float, vx: float, vy: float, radius_m: float, horizon_s: float) -> tuple[float, float, float]:
    """Return the outward unit normal at the boundary point of a velocity obstacle nearest to v, and how far v is inside it.

    The obstacle is the truncated cone of relative velocities that bring two discs, p apart and `radius_m` the sum of their
    radii, into touch within `horizon_s`; the depth is negative for a velocity outside of it.  The discs do not overlap.
    """
    wx, wy = vx - px / horizon_s, vy - py / horizon_s
    square, along = px * px + py * py, wx * px + wy * py
    if along < 0.0 and along * along > radius_m * radius_m * (wx * wx + wy * wy):  # the cap is nearer than the cone's legs
        length = np.hypot(wx, wy)
        return wx / length, wy / length, radius_m / horizon_s - length
    leg = np.sqrt(max(square - radius_m * radius_m, 0.0))
    if px * wy - py * wx > 0.0:  # left
        x, y = (px * leg - py * radius_m) / square, (px * radius_m + py * leg) / square
        normal_x, normal_y = -y, x
    else:
        x, y = (px * leg + py * radius_m) / square, (-px * radius_m + py * leg) / square
        normal_x, normal_y = y, -x
    return normal_x, normal_y, -(normal_x * vx + normal_y * vy)


@kernel()
def agent_half_planes(
    offset: F64, velocity: F64, radius_m: F64, own: F64, share: float, horizon_s: float, period_s: float
) -> tuple[F64, F64]:
    """Return normals, shape (n, 2), and bounds, shape (n,) [m/s], of the velocities that avoid n agents.

    Agents that overlap with the robot are to be left within one period, at full responsibility.

    Args:
        offset: from the robot to each agent, shape (n, 2).
        velocity: of each agent, shape (n, 2).
        radius_m: sum of the robot's radius and each agent's, shape (n,).
        own: the robot's velocity, shape (2,).
        share: of the change of relative velocity that the robot takes on; 0.5 among agents that do the same, 1 among others.
        horizon_s: for which there is to be no collision.
        period_s: between two decisions.
    """
    normals, bounds = np.empty((len(offset), 2)), np.empty(len(offset))
    for i in range(len(offset)):
        px, py, radius = offset[i, 0], offset[i, 1], radius_m[i]
        vx, vy = own[0] - velocity[i, 0], own[1] - velocity[i, 1]
        if np.hypot(px, py) > radius:
            x, y, depth = way_out(px, py, vx, vy, radius, horizon_s)
            part = share
        else:
            wx, wy = vx - px / period_s, vy - py / period_s
            length = np.hypot(wx, wy)
            x, y = (wx / length, wy / length) if length > 1e-9 else (-1.0, 0.0)
            depth, part = radius / period_s - length, 1.0
        normals[i, 0], normals[i, 1] = x, y
        bounds[i] = x * own[0] + y * own[1] + part * depth
    return normals, bounds


@kernel()
def standing_half_planes(offset: F64, radius_m: float, horizon_s: float) -> tuple[F64, F64]:
    """Return normals, shape (n, 2), and bounds, shape (n,) [m/s], of the velocities that do not reach n points within a time.

    The half-plane is taken where the velocity obstacle is nearest to standing still, so that standing still keeps all of
    them.  A point that is nearer than the radius is only not approached.
    """
    normals, bounds = np.empty((len(offset), 2)), np.empty(len(offset))
    for i in range(len(offset)):
        apart = np.hypot(offset[i, 0], offset[i, 1])
        x, y = (offset[i, 0] / apart, offset[i, 1] / apart) if apart > 1e-9 else (1.0, 0.0)
        normals[i, 0], normals[i, 1] = -x, -y
        bounds[i] = -max(apart - radius_m, 0.0) / horizon_s
    return normals, bounds
