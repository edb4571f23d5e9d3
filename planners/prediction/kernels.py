"""How obstacles move under a conjecture, one step at a time, and what an observation says of it; the scenario index last.

Source: Han, Zhu, RCSP, section 4.1 and appendix B (prediction, correction and predictive likelihood of each conjecture); the
reactions are ours, as the paper names them only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

_NEAR = 1e-6  # metres; keeps a direction finite where two points coincide


class Draws(NamedTuple):
    """Where scenarios start, and what drives them on."""

    position: F32  # (obstacles, 2, scenarios), in odom
    velocity: F32  # (obstacles, 2, scenarios)
    push: F32  # (obstacles, 2 holds, scenarios): accelerations, x and y, each held for `HOLD` steps, in standard deviations
    speed_factor: F32  # (obstacles, scenarios), and the other coefficients of each one's conjecture
    slowing: F32
    pursuit: F32
    least_speed: F32
    acceleration: F32
    contact_m: F32  # (obstacles,): distance of the centres at contact with the robot
    range_m: float


HOLD = 13  # steps


@kernel(fast=True, numpy_division=True)
def advance(draws: Draws, m: int, steps_s: F64, robot: F32, out: F32) -> None:
    """Write where obstacle m is after each step, in every scenario, into out, shape (steps, 2, scenarios).

    Near the robot it goes on with a share of its velocity, `along`, and makes `towards` of the way to the robot per second.  A
    loop that writes one array is vectorised; one that writes more is not, as there are too many pairs that might overlap, nor
    one that looks out for a division by zero.

    Args:
        draws: starts and coefficients.
        m: the obstacle.
        steps_s: lengths of the steps, shape (steps,).
        robot: where the robot is at the end of each, shape (steps, 2); the reaction is to where it is at the end before.
        out: futures of this obstacle.
    """
    n, push, strength = draws.position.shape[2], draws.push[m], draws.acceleration[m]
    x, y = draws.position[m, 0].copy(), draws.position[m, 1].copy()
    vx, vy = draws.velocity[m, 0].copy(), draws.velocity[m, 1].copy()
    factor, slowing, pursuit, least = draws.speed_factor[m], draws.slowing[m], draws.pursuit[m], draws.least_speed[m]
    along, away, towards = factor.copy(), np.empty(n, np.float32), np.zeros(n, np.float32)
    edge, slope = draws.contact_m[m] + np.float32(draws.range_m), np.float32(1.0 / draws.range_m)
    zero, one, near = np.float32(0.0), np.float32(1.0), np.float32(_NEAR)
    reacts = (np.abs(slowing) + np.abs(pursuit)).max() > 0.0
    for k in range(len(steps_s)):
        dt, rx, ry, hold = np.float32(steps_s[k]), robot[max(k - 1, 0), 0], robot[max(k - 1, 0), 1], k // HOLD * 2
        if reacts:
            for i in range(n):
                dx, dy = rx - x[i], ry - y[i]
                away[i] = np.sqrt(dx * dx + dy * dy)
            for i in range(n):
                g = (edge - away[i]) * slope
                g = zero if g < zero else (one if g > one else g)
                along[i] = factor[i] + slowing[i] * g
            for i in range(n):
                g = (edge - away[i]) * slope
                g = zero if g < zero else (one if g > one else g)
                speed = np.sqrt(vx[i] * vx[i] + vy[i] * vy[i])
                speed = least[i] if speed < least[i] else speed
                towards[i] = pursuit[i] * g * speed / (away[i] + near)
        for i in range(n):
            x[i] += (along[i] * vx[i] + towards[i] * (rx - x[i])) * dt
        for i in range(n):
            y[i] += (along[i] * vy[i] + towards[i] * (ry - y[i])) * dt
        for i in range(n):
            vx[i] += push[hold, i] * strength[i] * dt
        for i in range(n):
            vy[i] += push[hold + 1, i] * strength[i] * dt
        for i in range(n):
            out[k, 0, i] = x[i]
        for i in range(n):
            out[k, 1, i] = y[i]


@kernel()
def propagate(draws: Draws, steps_s: F64, robot: F32) -> F32:
    """Return the futures of all obstacles, shape (steps, obstacles, 2, scenarios), beside one motion of the robot, (steps, 2)."""
    obstacles, _, n = draws.position.shape
    futures = np.empty((len(steps_s), obstacles, 2, n), np.float32)
    for m in range(obstacles):
        advance(draws, m, steps_s, robot, futures[:, m])
    return futures


@kernel()
def drawn_starts(
    mean: F64, spread: F64, coefficients: F64, edges: F64, uniform: F32, normal: F32, push: F32, contact: F64, cap: F64,
    range_m: float,
) -> tuple[Draws, NDArray[np.int64]]:  # fmt: skip
    """Draw conjecture, position and velocity of every scenario; return them, and the conjectures, shape (obstacles, scenarios).

    Args:
        mean: x, y, vx, vy under each conjecture, shape (conjectures, obstacles, 4).
        spread: variance of position, covariance, variance of velocity, each axis, shape (conjectures, obstacles, 3).
        coefficients: as in `followed`.
        edges: cumulated weights of the conjectures, shape (rows, conjectures): one row for all obstacles or one for each.
        uniform: shape (rows, 1, scenarios).
        normal: standard normal, shape (obstacles, 4, scenarios).
        push: standard normal, shape (obstacles, 2 holds, scenarios).
        contact: distance of the centres at contact, shape (obstacles,).
        cap: largest standard deviation of position and velocity, shape (2,).
        range_m: of reaction.
    """
    obstacles, _, n = normal.shape
    conjectures = edges.shape[1]
    which = np.empty((obstacles, n), np.int64)
    position, velocity = np.empty((obstacles, 2, n), np.float32), np.empty((obstacles, 2, n), np.float32)
    of, scale = np.empty((5, obstacles, n), np.float32), np.empty((conjectures, 3))
    for m in range(obstacles):
        row = min(m, len(edges) - 1)
        for c in range(conjectures):
            p, v = np.sqrt(spread[c, m, 0]), np.sqrt(spread[c, m, 2])
            gain = spread[c, m, 1] / p if p > 0.0 else 0.0
            shrink_p, shrink_v = min(1.0, cap[0] / max(p, 1e-12)), min(1.0, cap[1] / max(v, 1e-12))
            scale[c] = shrink_p * p, shrink_v * gain, shrink_v * np.sqrt(max(spread[c, m, 2] - gain * gain, 0.0))
        for i in range(n):
            c = 0
            while c < conjectures - 1 and uniform[row, 0, i] >= edges[row, c]:
                c += 1
            which[m, i] = c
            for k in range(5):
                of[k, m, i] = coefficients[c, k]
            for axis in range(2):
                e, f = normal[m, axis, i], normal[m, 2 + axis, i]
                position[m, axis, i] = mean[c, m, axis] + scale[c, 0] * e
                velocity[m, axis, i] = mean[c, m, 2 + axis] + scale[c, 1] * e + scale[c, 2] * f
    contact_m = contact.astype(np.float32)
    return Draws(position, velocity, push, of[0], of[1], of[2], of[3], of[4], contact_m, range_m), which


@kernel()
def places_of(now: NDArray[np.int64], before: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return where in `before` each identity of `now` stands, shape (len(now),); -1: it is new."""
    places = np.full(len(now), -1)
    for i in range(len(now)):
        for j in range(len(before)):
            if before[j] == now[i]:
                places[i] = j
    return places


@kernel()
def followed(
    mean_before: F64, spread_before: F64, places: NDArray[np.int64], coefficients: F64, observed: F64, noise: F64, contact: F64,
    robot: F64, range_m: float, dt_s: float,
) -> tuple[F64, F64, F64]:  # fmt: skip
    """Carry each conjecture's belief over dt and correct it with what was observed; who is new begins with the observation.

    Position and velocity of a track are observed; the axes are taken as independent and alike, so that the state of an axis
    is (position, velocity) with a 2 x 2 covariance.

    Args:
        mean_before: x, y, vx, vy under each conjecture, shape (conjectures, obstacles before, 4).
        spread_before: variance of position, covariance, variance of velocity, shape (conjectures, obstacles before, 3).
        places: of the obstacles among those before, shape (obstacles,); -1: new.
        coefficients: speed factor, slowing, pursuit, least speed, acceleration, least noise of position and of velocity,
            shape (conjectures, 7).
        observed: x, y, vx, vy, shape (obstacles, 4).
        noise: of the observation, as `spread_before`, shape (obstacles, 3).
        contact: distance of the centres at contact, shape (obstacles,).
        robot: shape (2,).
        range_m: of reaction.
        dt_s: since the observation before.

    Returns:
        Means, spreads, and logarithms of the predictive densities, shape (conjectures, obstacles), zero for who is new.
    """
    conjectures, obstacles = len(coefficients), len(observed)
    mean, spread = np.empty((conjectures, obstacles, 4)), np.empty((conjectures, obstacles, 3))
    likelihood = np.zeros((conjectures, obstacles))
    for c in range(conjectures):
        for m in range(obstacles):
            if places[m] < 0:
                mean[c, m], spread[c, m] = observed[m], noise[m]
                continue
            mean[c, m], spread[c, m] = mean_before[c, places[m]], spread_before[c, places[m]]
            carried(mean[c, m], spread[c, m], coefficients[c], contact[m], robot, range_m, dt_s)
            likelihood[c, m] = corrected(mean[c, m], spread[c, m], coefficients[c], observed[m], noise[m])
    return mean, spread, likelihood


@kernel()
def carried(s: F64, p: F64, coefficients: F64, contact: float, robot: F64, range_m: float, dt_s: float) -> None:
    """Carry one belief, state s of shape (4,) and spread p of shape (3,), over dt under a conjecture (equation of appendix B)."""
    factor, slowing, pursuit, least, acceleration = coefficients[:5]
    dx, dy = robot[0] - s[0], robot[1] - s[1]
    distance = np.hypot(dx, dy) + _NEAR
    g = min(max(1.0 - (distance - contact) / range_m, 0.0), 1.0)
    towards = pursuit * g * max(np.hypot(s[2], s[3]), least) / distance
    a = (factor + slowing * g) * dt_s
    s[0] += a * s[2] + towards * dx * dt_s
    s[1] += a * s[3] + towards * dy * dt_s
    q = acceleration * acceleration
    p[0] += 2.0 * a * p[1] + a * a * p[2] + 0.25 * q * dt_s**4
    p[1] += a * p[2] + 0.5 * q * dt_s**3
    p[2] += q * dt_s * dt_s


@kernel()
def corrected(s: F64, p: F64, coefficients: F64, observed: F64, noise: F64) -> float:
    """Correct one belief with an observation, shape (4,); return the logarithm of its predictive density."""
    sigma_p, sigma_v = coefficients[5], coefficients[6]
    pp, pv, vv = p[0], p[1], p[2]
    s_pp, s_pv, s_vv = pp + noise[0] + sigma_p * sigma_p, pv + noise[1], vv + noise[2] + sigma_v * sigma_v
    det = s_pp * s_vv - s_pv * s_pv
    k_pp, k_pv = (pp * s_vv - pv * s_pv) / det, (pv * s_pp - pp * s_pv) / det
    k_vp, k_vv = (pv * s_vv - vv * s_pv) / det, (vv * s_pp - pv * s_pv) / det
    squared = 0.0
    for axis in range(2):
        e, f = observed[axis] - s[axis], observed[2 + axis] - s[2 + axis]
        squared += (s_vv * e * e - 2.0 * s_pv * e * f + s_pp * f * f) / det
        s[axis] += k_pp * e + k_pv * f
        s[2 + axis] += k_vp * e + k_vv * f
    p[0], p[1] = pp - k_pp * pp - k_pv * pv, pv - k_pp * pv - k_pv * vv
    p[2] = vv - k_vp * pv - k_vv * vv
    density: float = -0.5 * squared - np.log(det) - 2.0 * np.log(2.0 * np.pi)
    return density
