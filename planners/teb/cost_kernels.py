"""What a band keeps away from and passes by, and all its penalties together; arrays in, arrays out.

Source: Roesmann, Feiten, Woesch, Hoffmann, Bertram, Trajectory modification considering dynamic constraints of autonomous
robots, ROBOTIK 2012; the same, Efficient trajectory optimization using a sparse model, ECMR 2013.
"""

from __future__ import annotations

import numpy as np

from drivers.interface.kernel import kernel
from estimators.field_query import bilinear_gradient
from planners.teb.graph_kernels import BANDWIDTH, F64, Bounds, Ends, Indices, Normal, Scene, Weights, add_at_pose
from planners.teb.motion_kernels import add_acceleration, add_motion, segments_of


@kernel()
def add_standing(normal: Normal, poses: F64, scene: Scene, bounds: Bounds, weights: Weights) -> float:
    """Add the gaps of every free pose to what stands; return their cost."""
    cost, least = 0.0, bounds.least_gap_m + bounds.epsilon
    for i in range(1, len(poses) - 1):
        clearance, dx, dy = bilinear_gradient(
            scene.clearance, scene.corner_x, scene.corner_y, scene.cell_m, poses[i, 0], poses[i, 1]
        )
        gap = clearance - scene.body_m
        cost += add_at_pose(normal, i, -dx, -dy, max(least - gap, 0.0), weights.obstacle)
        cost += add_at_pose(normal, i, -dx, -dy, max(bounds.inflation_m - gap, 0.0), weights.inflation)
    return cost


@kernel()
def add_moving(normal: Normal, poses: F64, passed_s: F64, scene: Scene, bounds: Bounds, weights: Weights) -> float:
    """Add the gaps of every free pose to what moves, where it is when the robot passes; return their cost."""
    cost, least = 0.0, bounds.least_gap_m + bounds.epsilon
    for i in range(1, len(poses) - 1):
        for j in range(len(scene.centre)):
            dx = poses[i, 0] - scene.centre[j, 0] - passed_s[i] * scene.velocity[j, 0]
            dy = poses[i, 1] - scene.centre[j, 1] - passed_s[i] * scene.velocity[j, 1]
            apart = max(np.hypot(dx, dy), 1e-9)
            gap = apart - scene.radius_m[j] - scene.body_m
            cost += add_at_pose(normal, i, -dx / apart, -dy / apart, max(least - gap, 0.0), weights.moving)
            residual = max(bounds.moving_inflation_m - gap, 0.0)
            cost += add_at_pose(normal, i, -dx / apart, -dy / apart, residual, weights.moving_inflation)
    return cost


@kernel()
def add_via(normal: Normal, poses: F64, nearest: Indices, scene: Scene, weights: Weights) -> float:
    """Add the distances of the points to pass by to their poses, by index, shape (k,); return their cost."""
    cost = 0.0
    for k in range(len(scene.via)):
        i = nearest[k]
        if i > 0:
            cost += add_at_pose(normal, i, 1.0, 0.0, poses[i, 0] - scene.via[k, 0], weights.via)
            cost += add_at_pose(normal, i, 0.0, 1.0, poses[i, 1] - scene.via[k, 1], weights.via)
    return cost


@kernel()
def nearest_poses(poses: F64, points: F64) -> Indices:
    """Return the free pose nearest to each point, shape (k,); 0, which is fixed, in a band that has none."""
    nearest = np.zeros(len(points), np.int64)
    for k in range(len(points)):
        best = np.inf
        for i in range(1, len(poses) - 1):
            apart = (poses[i, 0] - points[k, 0]) ** 2 + (poses[i, 1] - points[k, 1]) ** 2
            if apart < best:
                best, nearest[k] = apart, i
    return nearest


@kernel()
def evaluated(
    poses: F64, times: F64, passed_s: F64, nearest: Indices, scene: Scene, bounds: Bounds, weights: Weights, ends: Ends,
    derive: bool,
) -> tuple[float, Normal]:  # fmt: skip
    """Return the cost of a band and Gauss-Newton's equations at it; these are empty when they are not asked for.

    When the poses are passed, shape (n,), and which are nearest to the points to pass by, shape (k,), is held fixed.
    """
    unknowns = 4 * (len(poses) - 2) + 1 if derive else 0
    normal = Normal(np.zeros((unknowns, BANDWIDTH + 1)), np.zeros(unknowns))
    seg = segments_of(poses, times)
    cost = add_motion(normal, seg, times, bounds, weights)
    cost += add_acceleration(normal, seg, times, ends, 0, bounds.acceleration_m_s2, weights.acceleration)
    cost += add_acceleration(normal, seg, times, ends, 1, bounds.acceleration_rad_s2, weights.turning)
    cost += add_standing(normal, poses, scene, bounds, weights)
    cost += add_moving(normal, poses, passed_s, scene, bounds, weights)
    cost += add_via(normal, poses, nearest, scene, weights)
    return cost, normal
