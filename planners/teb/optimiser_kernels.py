"""Levenberg and Marquardt's method on a band, its equations solved by a banded Cholesky factorisation.

Source: Roesmann et al., Efficient trajectory optimization using a sparse model, ECMR 2013, section III; the damping follows
Madsen, Nielsen, Tingleff, Methods for non-linear least squares problems, 2004, section 3.2.
"""

from __future__ import annotations

import numpy as np

from drivers.interface.kernel import kernel
from planners.teb.cost_kernels import evaluated, nearest_poses
from planners.teb.graph_kernels import BANDWIDTH, F64, Bounds, Ends, Scene, Weights

_SHORTEST_S = 1e-3  # between two poses
_START_DAMPING = 1e-4  # of the largest element of the diagonal
_SETTLED = 3e-3  # an iteration that takes off less of the cost is the last of its round
_LONGEST_STEP = 0.25  # of any unknown [m, rad, s]: beyond it the penalties are not what they look like here


@kernel()
def solve_banded(matrix: F64, right: F64) -> tuple[bool, F64]:
    """Return whether a banded symmetric matrix, as in `Normal`, is positive definite, and the solution, shape (n,)."""
    n = len(right)
    factor, x = np.zeros_like(matrix), right.copy()
    for i in range(n):
        for k in range(min(i, BANDWIDTH), -1, -1):  # column i - k
            j = i - k
            value = matrix[i, k]
            for m in range(max(i - BANDWIDTH, j - BANDWIDTH, 0), j):
                value -= factor[i, i - m] * factor[j, j - m]
            if k > 0:
                factor[i, k] = value / factor[j, 0]
            elif value <= 0.0 or not np.isfinite(value):
                return False, x
            else:
                factor[i, 0] = np.sqrt(value)
    for i in range(n):
        for m in range(max(i - BANDWIDTH, 0), i):
            x[i] -= factor[i, i - m] * x[m]
        x[i] /= factor[i, 0]
    for i in range(n - 1, -1, -1):
        for m in range(i + 1, min(i + BANDWIDTH + 1, n)):
            x[i] -= factor[m, m - i] * x[m]
        x[i] /= factor[i, 0]
    return True, x


@kernel()
def stepped(poses: F64, times: F64, step: F64) -> tuple[F64, F64]:
    """Return the band with a step of the unknowns, shape (4 (n - 2) + 1,), added; the times keep a least length."""
    moved, spent = poses.copy(), times.copy()
    for i in range(len(times)):
        spent[i] = max(times[i] + step[4 * i], min(times[i], _SHORTEST_S))
        if i > 0:
            moved[i] += step[4 * i - 3 : 4 * i]
    return moved, spent


@kernel()
def passing_times(times: F64) -> F64:
    """Return when each pose is passed, shape (n,), for the times between them, shape (n - 1,)."""
    passed = np.zeros(len(times) + 1)
    passed[1:] = np.cumsum(times)
    return passed


@kernel()
def improved(
    poses: F64, times: F64, scene: Scene, bounds: Bounds, weights: Weights, ends: Ends, iterations: int
) -> tuple[F64, F64, float]:  # fmt: skip
    """Return the band after so many iterations at most, and its cost."""
    passed, nearest = passing_times(times), nearest_poses(poses, scene.via)
    cost, normal = evaluated(poses, times, passed, nearest, scene, bounds, weights, ends, True)
    damping, growth = _START_DAMPING * normal.matrix[:, 0].max(), 2.0
    for _ in range(iterations):
        matrix = normal.matrix.copy()
        matrix[:, 0] += damping
        definite, step = solve_banded(matrix, -normal.gradient)
        if definite:
            share = min(1.0, _LONGEST_STEP / max(np.abs(step).max(), 1e-12))
            tried_poses, tried_times = stepped(poses, times, share * step)
            tried, tried_normal = evaluated(tried_poses, tried_times, passed, nearest, scene, bounds, weights, ends, True)
            downhill = -(step @ normal.gradient)
            foreseen = share * (2.0 - share) * downhill + share * share * damping * (step @ step)
            if tried < cost and foreseen > 0.0:
                gain = (cost - tried) / foreseen
                damping, growth = damping * max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), 2.0
                settled = cost - tried < _SETTLED * cost
                poses, times, cost, normal = tried_poses, tried_times, tried, tried_normal
                if settled:
                    break
                continue
        damping, growth = damping * growth, 2.0 * growth
    return poses, times, cost


@kernel()
def resized(poses: F64, times: F64, wanted_s: float, play_s: float, least: int, most: int) -> tuple[F64, F64]:
    """Return the band with a pose more where the time is longer than wanted, one less where it is shorter, within a play."""
    more_poses, more_times = np.empty((2 * len(poses), 3)), np.empty(2 * len(poses))
    more_poses[0], n, count = poses[0], 0, len(poses)
    carried = 0.0
    for i in range(len(times)):
        span, last = times[i] + carried, i == len(times) - 1
        carried = 0.0
        if span > wanted_s + play_s and count < most:
            middle = 0.5 * (more_poses[n] + poses[i + 1])
            middle[2] = more_poses[n, 2] + 0.5 * ((poses[i + 1, 2] - more_poses[n, 2] + np.pi) % (2.0 * np.pi) - np.pi)
            more_times[n], more_times[n + 1] = 0.5 * span, 0.5 * span
            more_poses[n + 1], more_poses[n + 2] = middle, poses[i + 1]
            n, count = n + 2, count + 1
        elif span < wanted_s - play_s and count > least and not last:
            carried, count = span, count - 1
        elif span < wanted_s - play_s and count > least and n > 0:  # the last one goes into the one before
            more_times[n - 1] += span
            more_poses[n] = poses[i + 1]
            count -= 1
        else:
            more_times[n], more_poses[n + 1] = span, poses[i + 1]
            n += 1
    return more_poses[: n + 1].copy(), more_times[:n].copy()


@kernel()
def optimised(
    poses: F64, times: F64, scene: Scene, bounds: Bounds, weights: Weights, ends: Ends,
    wanted_s: float, play_s: float, most: int, outer: int, inner: int, growth: float,
) -> tuple[F64, F64, float]:  # fmt: skip
    """Return the band after `outer` rounds of resizing and `inner` iterations, and its cost by the weights given.

    From round to round the weight of what stands is multiplied by `growth`, so that the first ones move the band more freely.
    """
    obstacle = weights.obstacle
    for _ in range(outer):
        poses, times = resized(poses, times, wanted_s, play_s, 3, most)
        harder = _with_obstacle(weights, obstacle)
        poses, times, _ = improved(poses, times, scene, bounds, harder, ends, inner)
        obstacle *= growth
    passed, nearest = passing_times(times), nearest_poses(poses, scene.via)
    cost, _ = evaluated(poses, times, passed, nearest, scene, bounds, weights, ends, False)
    return poses, times, cost


@kernel()
def _with_obstacle(weights: Weights, obstacle: float) -> Weights:
    """Return the weights with another one of what stands."""
    w = weights
    return Weights(
        w.time, w.sideways, w.forward, w.speed, w.rate, w.acceleration, w.turning, obstacle, w.inflation, w.moving,
        w.moving_inflation, w.via,
    )  # fmt: skip
