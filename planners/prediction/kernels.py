"""How obstacles move under a conjecture, one step at a time, and what an observation says of it; the scenario index last.

Source: Han, Zhu, RCSP, section 4.1 and appendix B (prediction, correction and predictive likelihood of each conjecture); the
reactions are ours, as the paper names them only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

_NEAR = 1e-6  # metres; keeps a direction finite where two points coincide


class Draws(NamedTuple):
    """Where scenarios start, and what drives them on."""

    position: F32  # (obstacles, 2, scenarios), in odom
    velocity: F32  # (obstacles, 2, scenarios)
    push: F32  # (holds, obstacles, 2, scenarios): accelerations, each held for `HOLD` steps
    speed_factor: F32  # (obstacles, scenarios), and the other coefficients of each one's conjecture
    slowing: F32
    pursuit: F32
    least_speed: F32
    contact_m: F32  # (obstacles,): distance of the centres at contact with the robot
    range_m: float


HOLD = 5  # steps


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc", "arcp", "nsz"})  # type: ignore[untyped-decorator]
def advance(draws: Draws, m: int, steps_s: F64, robot: F32, out: F32, first: int) -> None:
    """Write where obstacle m is after each step, in every scenario, into out[first + k, :, :], shape (steps, 2, scenarios).

    Args:
        draws: starts and coefficients.
        m: the obstacle.
        steps_s: lengths of the steps, shape (steps,).
        robot: where the robot is at the end of each, shape (steps, 2); the reaction is to where it is at the end before.
        out: futures of this obstacle.
        first: row of `out` to begin with.
    """
    n = draws.position.shape[2]
    x, y = draws.position[m, 0].copy(), draws.position[m, 1].copy()
    vx, vy = draws.velocity[m, 0].copy(), draws.velocity[m, 1].copy()
    factor, slowing, pursuit, least = draws.speed_factor[m], draws.slowing[m], draws.pursuit[m], draws.least_speed[m]
    contact, slope = draws.contact_m[m], np.float32(1.0 / draws.range_m)
    reacts = False
    for i in range(n):
        reacts = reacts or slowing[i] != 0.0 or pursuit[i] != 0.0
    zero, one, near = np.float32(0.0), np.float32(1.0), np.float32(_NEAR)
    for k in range(len(steps_s)):
        dt = np.float32(steps_s[k])
        push_x, push_y = draws.push[k // HOLD, m, 0], draws.push[k // HOLD, m, 1]
        row_x, row_y = out[first + k, 0], out[first + k, 1]
        rx, ry = robot[max(k - 1, 0), 0], robot[max(k - 1, 0), 1]
        if reacts:
            for i in range(n):
                dx, dy = rx - x[i], ry - y[i]
                distance = np.sqrt(dx * dx + dy * dy) + near
                g = one - (distance - contact) * slope
                g = zero if g < zero else (one if g > one else g)
                speed = np.sqrt(vx[i] * vx[i] + vy[i] * vy[i])
                speed = least[i] if speed < least[i] else speed
                along, towards = factor[i] + slowing[i] * g, pursuit[i] * g * speed / distance
                x[i] += (along * vx[i] + towards * dx) * dt
                y[i] += (along * vy[i] + towards * dy) * dt
                vx[i] += push_x[i] * dt
                vy[i] += push_y[i] * dt
                row_x[i], row_y[i] = x[i], y[i]
        else:
            for i in range(n):
                x[i] += factor[i] * vx[i] * dt
                y[i] += factor[i] * vy[i] * dt
                vx[i] += push_x[i] * dt
                vy[i] += push_y[i] * dt
                row_x[i], row_y[i] = x[i], y[i]


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def propagate(draws: Draws, steps_s: F64, robot: F32) -> F32:
    """Return the futures of all obstacles, shape (steps, obstacles, 2, scenarios), beside one motion of the robot, (steps, 2)."""
    obstacles, _, n = draws.position.shape
    futures = np.empty((len(steps_s), obstacles, 2, n), np.float32)
    own = np.empty((len(steps_s), 2, n), np.float32)
    for m in range(obstacles):
        advance(draws, m, steps_s, robot, own, 0)
        futures[:, m] = own
    return futures


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def spread_draws(mean: F64, spread: F64, which: NDArray[np.int64], normal: F32, cap: F64, position: F32, velocity: F32) -> None:
    """Draw positions and velocities, shapes (obstacles, 2, scenarios), from the belief of each scenario's conjecture.

    Args:
        mean: x, y, vx, vy under each conjecture, shape (conjectures, obstacles, 4).
        spread: variance of position, covariance, variance of velocity, each axis, shape (conjectures, obstacles, 3).
        which: the conjecture, shape (obstacles, scenarios).
        normal: standard normal, shape (4, obstacles, scenarios).
        cap: largest standard deviation of position and velocity, shape (2,).
        position: written.
        velocity: written.
    """
    obstacles, n = which.shape
    for m in range(obstacles):
        for i in range(n):
            c = which[m, i]
            pp, pv, vv = spread[c, m, 0], spread[c, m, 1], spread[c, m, 2]
            p = np.sqrt(pp)
            gain = pv / p if p > 0.0 else 0.0
            rest = np.sqrt(max(vv - gain * gain, 0.0))
            shrink_p, shrink_v = min(1.0, cap[0] / max(p, 1e-12)), min(1.0, cap[1] / max(np.sqrt(vv), 1e-12))
            for axis in range(2):
                e, f = normal[axis, m, i], normal[2 + axis, m, i]
                position[m, axis, i] = mean[c, m, axis] + shrink_p * p * e
                velocity[m, axis, i] = mean[c, m, 2 + axis] + shrink_v * (gain * e + rest * f)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def assimilate(
    mean: F64, spread: F64, coefficients: F64, observed: F64, noise: F64, contact: F64, robot: F64, range_m: float, dt_s: float
) -> F64:
    """Carry each conjecture's belief over dt and correct it with what was observed; return the predictive log-likelihoods.

    Position and velocity of a track are observed; the axes are taken as independent and alike, so that the state of an axis
    is (position, velocity) with a 2 x 2 covariance.

    Args:
        mean: as in `spread_draws`; overwritten.
        spread: likewise.
        coefficients: speed factor, slowing, pursuit, least speed, acceleration, least noise of position and of velocity,
            shape (conjectures, 7).
        observed: x, y, vx, vy, shape (obstacles, 4).
        noise: of the observation, as `spread`, shape (obstacles, 3).
        contact: distance of the centres at contact, shape (obstacles,).
        robot: shape (2,).
        range_m: of reaction.
        dt_s: since the observation before.

    Returns:
        Logarithms of the densities, shape (conjectures, obstacles).
    """
    conjectures, obstacles, _ = mean.shape
    likelihood = np.empty((conjectures, obstacles))
    for c in range(conjectures):
        factor, slowing, pursuit, least, acceleration, sigma_p, sigma_v = coefficients[c]
        for m in range(obstacles):
            s, p = mean[c, m], spread[c, m]
            dx, dy = robot[0] - s[0], robot[1] - s[1]
            distance = np.hypot(dx, dy) + _NEAR
            g = min(max(1.0 - (distance - contact[m]) / range_m, 0.0), 1.0)
            towards = pursuit * g * max(np.hypot(s[2], s[3]), least) / distance
            a = (factor + slowing * g) * dt_s
            s[0] += a * s[2] + towards * dx * dt_s
            s[1] += a * s[3] + towards * dy * dt_s
            q = acceleration * acceleration
            pp = p[0] + 2.0 * a * p[1] + a * a * p[2] + 0.25 * q * dt_s**4
            pv = p[1] + a * p[2] + 0.5 * q * dt_s**3
            vv = p[2] + q * dt_s * dt_s
            s_pp, s_vv = pp + noise[m, 0] + sigma_p * sigma_p, vv + noise[m, 2] + sigma_v * sigma_v
            s_pv = pv + noise[m, 1]
            det = s_pp * s_vv - s_pv * s_pv
            k_pp, k_pv = (pp * s_vv - pv * s_pv) / det, (pv * s_pp - pp * s_pv) / det
            k_vp, k_vv = (pv * s_vv - vv * s_pv) / det, (vv * s_pp - pv * s_pv) / det
            squared = 0.0
            for axis in range(2):
                e, f = observed[m, axis] - s[axis], observed[m, 2 + axis] - s[2 + axis]
                squared += (s_vv * e * e - 2.0 * s_pv * e * f + s_pp * f * f) / det
                s[axis] += k_pp * e + k_pv * f
                s[2 + axis] += k_vp * e + k_vv * f
            p[0], p[1], p[2] = pp - k_pp * pp - k_pv * pv, pv - k_pp * pv - k_pv * vv, vv - k_vp * pv - k_vv * vv
            likelihood[c, m] = -0.5 * squared - np.log(det) - 2.0 * np.log(2.0 * np.pi)
    return likelihood
