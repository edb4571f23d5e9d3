"""A velocity that follows another with limited jerk, and how much jerk a situation asks for."""

from __future__ import annotations

import numpy as np

from drivers.interface.kernel import kernel
from estimators.belief import F64, Mask
from estimators.field_query import bilinear
from planners.clearance_manifold.ridge_kernels import Ground

OVER_M_S = 0.1
EARLY, HALF = 0.3, 0.5  # shares of the time to an encounter: what is left late costs more jerk than what is done early
SOONEST_S = 0.3  # nothing is answered faster than the base can


@kernel()
def followed(
    velocity: F64, acceleration: F64, wanted: F64, jerk: float, urgent: float, most: float, response_per_s: float, dt: float
) -> tuple[F64, F64]:
    """Return velocity and acceleration a step of `dt` later, each shape (2,).

    The acceleration heads for the largest one that can be ended with `jerk` when `wanted` is reached, at most `response_per_s`
    times what is missing, so that noise in `wanted` is damped and a step is followed without overshoot.  An acceleration that
    is wanted no more, as one that was built up in an emergency, is ended before it has changed the velocity by `OVER_M_S`.

    Args:
        velocity: shape (2,) [m/s].
        acceleration: shape (2,) [m/s^2].
        wanted: velocity, shape (2,).
        jerk: the acceleration changes by at most so much per second [m/s^3], unless it is to be ended:
        urgent: then by this.
        most: largest acceleration.
        response_per_s: of small differences.
        dt: step [s].
    """
    missing = wanted - velocity
    gap = np.hypot(missing[0], missing[1])
    share = 0.0
    if gap > 1e-9:
        ending = jerk * (np.sqrt(dt * dt + 2.0 * gap / jerk) - dt)
        share = min(ending, response_per_s * gap, most) / gap
    change = share * missing - acceleration
    length = np.hypot(change[0], change[1])
    if change[0] * acceleration[0] + change[1] * acceleration[1] < 0.0:
        jerk = max(jerk, min(length * length / (2.0 * OVER_M_S), urgent))
    if length > jerk * dt:
        change = change * (jerk * dt / length)
    after = acceleration + change
    return velocity + after * dt, after


@kernel()
def jerk_to_stop(speed: float, distance: float) -> float:
    """Return the jerk with which a stop from `speed` takes `distance`: v^3 / d^2 [m/s^3]; infinite where there is no way left.

    >>> jerk_to_stop(0.5, 0.25)
    2.0
    """
    return speed * speed * speed / (distance * distance) if distance > 1e-6 else np.inf


@kernel()
def jerk_to_pass(change: float, time_s: float) -> float:
    """Return the jerk that has changed a velocity by `change` early in the time, in 0.3 of it: 4 change / T^2 in T [m/s^3].

    >>> round(jerk_to_pass(0.36, 2.0), 9)
    4.0
    """
    within_s = EARLY * max(time_s, SOONEST_S)
    return 4.0 * change / (within_s * within_s)


@kernel()
def jerk_to_move(distance: float, time_s: float) -> float:
    """Return the constant jerk that moves a robot at rest by `distance` in half of a time: 6 d / T^3 in T [m/s^3].

    >>> jerk_to_move(0.5, 2.0)
    3.0
    """
    within_s = HALF * max(time_s, SOONEST_S)
    return 6.0 * distance / (within_s * within_s * within_s)


@kernel()
def time_to_pass(robot: F64, closing: F64, near_m: float) -> float:
    """Return when what closes in, shape (5,), passes a robot at rest, shape (2,) [s]; infinite if it does not within `near_m`."""
    speed2 = closing[2] * closing[2] + closing[3] * closing[3]
    if closing[4] == 0.0 or speed2 < 1e-4:
        return np.inf
    x, y = closing[0] - robot[0], closing[1] - robot[1]
    time = float(max(0.0, -(x * closing[2] + y * closing[3]) / speed2))
    away = np.hypot(x + time * closing[2], y + time * closing[3])
    return time if time > 0.0 and away < near_m else np.inf


@kernel()
def room_along(ground: Ground, known: Mask, robot: F64, direction: F64, least_m: float, body_m: float, most_m: float) -> float:
    """Return how far the robot can go straight on until it has less clearance than `least_m` or has not seen the place [m].

    Args:
        ground: the field.
        known: what was seen, shape (rows, columns).
        robot: in odom, shape (2,).
        direction: shape (2,), unit.
        least_m: clearance that it needs.
        body_m: nearer cells are stood on already, whether seen or not.
        most_m: no farther is looked.
    """
    step, way = 0.5 * ground.cell_m, 0.0
    while way < most_m:
        way += step
        x, y = robot[0] + way * direction[0], robot[1] + way * direction[1]
        row, column = int(np.floor((y - ground.y_m) / ground.cell_m)), int(np.floor((x - ground.x_m) / ground.cell_m))
        inside = 0 <= row < known.shape[0] and 0 <= column < known.shape[1]
        if way > body_m and not (inside and known[row, column]):
            return way - step
        if bilinear(ground.clearance, ground.x_m, ground.y_m, ground.cell_m, x, y) < least_m:
            return way - step
    return most_m
