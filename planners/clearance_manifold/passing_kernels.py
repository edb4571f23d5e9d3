"""Who comes: when and on which hand he passes, and what that leaves of the cross-sections."""

from __future__ import annotations

import numpy as np

from drivers.interface.kernel import kernel
from estimators.belief import F64
from planners.clearance_manifold.branch_kernels import BODY_M, EARLY
from planners.clearance_manifold.ridge_kernels import Sections

ALONG = 0.3  # the share of a velocity that leads across the way of who comes along it, at most
ABREAST_M = 0.30  # so far past his middle somebody still is beside the robot
SOONEST_S = 0.5  # nobody is evaded faster than the base can


@kernel()
def meeting(point: F64, closing: F64) -> tuple[float, float]:
    """Return when what closes in passes a point [s], and how far to its left it has the point...

    Args:
        point: in odom, shape (2,).
        closing: middle, velocity and number of cells of the boundary, shape (5,).
    """
    speed2 = closing[2] * closing[2] + closing[3] * closing[3]
    if closing[4] == 0.0 or speed2 < 0.01:
        return float(np.nan), float(np.nan)
    x, y = closing[0] - point[0], closing[1] - point[1]
    return -(x * closing[2] + y * closing[3]) / speed2, float((y * closing[2] - x * closing[3]) / np.sqrt(speed2))


@kernel()
def runs_along(normal: F64, closing: F64) -> bool:
    """Return whether what closes in, shape (5,), moves along a way with this normal, shape (2,), unit."""
    return bool(abs(closing[2] * normal[0] + closing[3] * normal[1]) <= ALONG * np.hypot(closing[2], closing[3]))


@kernel()
def left_to(hand: float, sections: Sections, own: int, robot: F64, speed_m_s: float, closing: F64, least_m: float) -> F64:
    """Return what somebody who comes along the way leaves of the cross-sections on the robot's hand of him, shape (n, 2) [m].

    From the robot's own section on, wherever he still comes by once the robot can be there, they end at his side.

    Args:
        hand: on which he passes, seen along his way: 1 left of the robot, -1 right of it.
        sections: all of them.
        own: index of the robot's.
        robot: in odom, shape (2,).
        speed_m_s: the fastest that the robot arrives with.
        closing: middle, velocity and number of cells of the boundary, shape (5,); it moves.
        least_m: clearance that the robot keeps of him.
    """
    reach = sections.reach.copy()
    speed = np.hypot(closing[2], closing[3])
    left_x, left_y = -closing[3] / speed, closing[2] / speed
    beside, point = BODY_M + least_m, np.empty(2)
    for i in range(own, len(reach)):
        leads = sections.normal[i, 0] * left_x + sections.normal[i, 1] * left_y  # -1 or 1, nearly
        if abs(leads) < ALONG:  # where the way turns he crosses it
            continue
        _, miss = meeting(sections.at[i], closing)
        end = (miss - hand * beside) / leads
        point[0], point[1] = sections.at[i, 0] + end * sections.normal[i, 0], sections.at[i, 1] + end * sections.normal[i, 1]
        first = EARLY * np.hypot(point[0] - robot[0], point[1] - robot[1]) / speed_m_s if i > own else 0.0
        if meeting(point, closing)[0] + ABREAST_M / speed > first:
            if hand * leads > 0.0:
                reach[i, 1] = min(reach[i, 1], end)
            else:
                reach[i, 0] = max(reach[i, 0], end)
    return reach


@kernel()
def give_way(u: F64, robot: F64, closing: F64, apart_m: float, horizon_s: float, hand: float) -> F64:
    """Return the velocity nearest to u, shape (2,), with which what closes in passes at `apart_m` if it goes on as it does.

    Standing still, the robot would be missed by the signed distance m, across the other's way, after the time t of closest
    approach; with a velocity across that way of at most (m - apart) / t it is missed by enough: it does not cross in front of
    who crosses before it.  Who is beside the robot is not fled from; it only does not go towards him.

    Args:
        u: velocity in odom [m/s].
        robot: in odom, shape (2,).
        closing: middle, velocity and number of cells of the boundary, shape (5,).
        apart_m: between the middle and the robot's centre.
        horizon_s: later encounters do not count.
        hand: on which he passes (`Passing`), seen along his way: 1 left of the robot, -1 right of it; 0: nobody comes.
    """
    time_s, miss_m = meeting(robot, closing)
    if hand == 0.0 or not time_s < horizon_s:
        return u
    speed = np.hypot(closing[2], closing[3])
    n_x, n_y = -hand * closing[3] / speed, hand * closing[2] / speed
    room_m = hand * miss_m - apart_m
    most = room_m / max(time_s, SOONEST_S) if time_s > 0.0 or room_m > 0.0 else 0.0
    excess = u[0] * n_x + u[1] * n_y - most
    if excess <= 0.0:
        return u
    return np.array([u[0] - excess * n_x, u[1] - excess * n_y])
