"""Cross-sections of the predicted field: the ridge, the box around it, and the branch that is followed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from estimators.belief import F32, F64
from estimators.field_query import bilinear

_FINE = 5  # samples of a tube, to either side
BODY_M = 0.25  # from the middle of a boundary that closes in to its sides
NARROW = 5.0  # cost of a station where the shield would stop; less, the nearer it is to ample
EARLY = 0.7  # of the time to a place: the robot may be there so early
STEEP = 2.0  # no branch is steeper: from one station to the next it would lead through what stands between them
COMMITTED_M = 0.1  # so far from the line of who comes the robot has begun to let him pass,
FAR_M = 0.7  # and so far from it he is nobody's
ALONG = 0.3  # the share of a velocity that leads across the way of who comes along it, at most
CROSS, BEGIN = 3.0, 20.0  # cost of a station on the other side of that line, and of the robot's own: it is not there
AWAY = 4.0  # cost of a squared distance between the robot and its own station, per square metre


class Sections(NamedTuple):
    """Where the cross-sections lie, in odom."""

    at: F64  # (n, 2), on the centre line
    normal: F64  # (n, 2), unit, to the left
    reach: F64  # (n, 2), lowest and highest offset looked at [m]


class Ground(NamedTuple):
    """The predicted field and its lattice."""

    clearance: F32  # (rows, columns) [m]
    x_m: float
    y_m: float
    cell_m: float


class Demand(NamedTuple):
    """What a station must have, and what it likes."""

    least_m: float  # rho_min
    kept_m: float  # what the shield keeps; where there is less it lets nobody through
    ample_m: float  # full speed is driven with it, and a place with as much is not narrow
    enough_m: float  # more clearance than this makes no better ridge
    centring: float  # clearance that a metre nearer to the centre line is worth


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def clearance_at(ground: Ground, sections: Sections, i: int, y: float) -> float:
    """Return rho(xi_i, y) [m]."""
    value: float = bilinear(
        ground.clearance, ground.x_m, ground.y_m, ground.cell_m,
        sections.at[i, 0] + y * sections.normal[i, 0], sections.at[i, 1] + y * sections.normal[i, 1],
    )  # fmt: skip
    return value


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def worth(clearance: float, y: float, demand: Demand) -> float:
    """Return how good a ridge is: clearance as far as it counts, nearness to the centre line where it is enough."""
    return min(clearance, demand.enough_m) - demand.centring * abs(y)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def box_around(ground: Ground, sections: Sections, i: int, inside: float, step_m: float, demand: Demand) -> F64:
    """Return lower and upper end of the interval around `inside` with rho >= rho_min, and the ridge in it, shape (3,) [m].

    Source: Cui, Deng, Wang, proposition 1.  `inside` must have that clearance itself.
    """
    found = np.empty(3)
    best, ridge = worth(clearance_at(ground, sections, i, inside), inside, demand), inside
    for side in range(2):
        sign = 1.0 if side else -1.0
        end, y, before = sections.reach[i, side], inside, clearance_at(ground, sections, i, inside)
        while sign * (end - y) > 1e-9:
            ahead = sign * min(sign * (y + sign * step_m), sign * end)
            here = clearance_at(ground, sections, i, ahead)
            if here < demand.least_m:
                y += (ahead - y) * (before - demand.least_m) / max(before - here, 1e-9)
                break
            y, before = ahead, here
            value = worth(here, y, demand)
            if value > best:
                best, ridge = value, y
        found[side] = y
    found[2] = ridge
    return found


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def ample_boxes(ground: Ground, sections: Sections, found: F64, step_m: float, demand: Demand) -> F64:
    """Return the part of each box around its ridge that keeps `ample_m`, or half of what the ridge has beyond rho_min, (n, 2).

    Args:
        ground: the predicted field.
        sections: the cross-sections.
        found: boxes and ridges, shape (n, 3), as `boxes` gives them; NaN where there is none.
        step_m: of the search.
        demand: what a station must have, and what it likes.
    """
    ample = found[:, :2].copy()
    for i in range(len(found)):
        if not np.isfinite(found[i, 2]):
            continue
        top = clearance_at(ground, sections, i, found[i, 2])
        level = min(demand.ample_m, 0.5 * (demand.least_m + top))
        for side in range(2):
            sign = 1.0 if side else -1.0
            end, y, before = found[i, side], found[i, 2], top
            while sign * (end - y) > 1e-9:
                ahead = sign * min(sign * (y + sign * step_m), sign * end)
                here = clearance_at(ground, sections, i, ahead)
                if here < level:
                    y += (ahead - y) * (before - level) / max(before - here, 1e-9)
                    break
                y, before = ahead, here
            ample[i, side] = y
    return ample


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def profiles(ground: Ground, sections: Sections, offsets: F64) -> F64:
    """Return rho at every station and offset, shape (n, m); -1 beyond a section's reach."""
    rho = np.full((len(sections.at), len(offsets)), -1.0)
    for i in range(rho.shape[0]):
        for j in range(rho.shape[1]):
            y = offsets[j]
            if sections.reach[i, 0] <= y <= sections.reach[i, 1]:
                rho[i, j] = clearance_at(ground, sections, i, y)
    return rho


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def encounters(sections: Sections, offsets: F64, robot: F64, speed_m_s: float, horizon_s: float, closing: F64) -> F64:
    """Return how near what closes in comes to every station and offset once the robot can be there, shape (n, m) [m].

    The robot may be later than it hopes, as it yields; so all that comes there after its earliest arrival counts: a branch that
    crosses before somebody is bad for as long as he is on his way, one that crosses behind him is free once he is past.

    Args:
        sections: from the robot's own on.
        offsets: shape (m,).
        robot: in odom, shape (2,).
        speed_m_s: the fastest that the robot arrives with.
        horizon_s: how far it is extrapolated.
        closing: middle, velocity and number of cells of the boundary, shape (5,).
    """
    apart = np.full((len(sections.at), len(offsets)), np.inf)
    if closing[4] == 0.0:
        return apart
    speed2 = max(closing[2] * closing[2] + closing[3] * closing[3], 1e-6)
    for i in range(len(sections.at)):
        for j in range(len(offsets)):
            x = sections.at[i, 0] + offsets[j] * sections.normal[i, 0]
            y = sections.at[i, 1] + offsets[j] * sections.normal[i, 1]
            first = min(EARLY * np.hypot(x - robot[0], y - robot[1]) / speed_m_s, horizon_s)
            nearest = ((x - closing[0]) * closing[2] + (y - closing[1]) * closing[3]) / speed2
            t = min(max(nearest, first), horizon_s)
            apart[i, j] = np.hypot(x - closing[0] - closing[2] * t, y - closing[1] - closing[3] * t) - BODY_M
    return apart


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def side_of(robot: F64, normal: F64, horizon_s: float, closing: F64) -> float:
    """Return how far to his left the robot is off the line of who comes along the way [m], NaN where nobody comes near it.

    Args:
        robot: in odom, shape (2,).
        normal: of the way where the robot is, to its left, unit, shape (2,).
        horizon_s: who comes later does not count.
        closing: middle, velocity and number of cells of the boundary, shape (5,).
    """
    speed2 = closing[2] * closing[2] + closing[3] * closing[3]
    if closing[4] == 0.0 or speed2 < 0.01:
        return float(np.nan)
    x, y, speed = robot[0] - closing[0], robot[1] - closing[1], np.sqrt(speed2)
    side, time_s = float((y * closing[2] - x * closing[3]) / speed), (x * closing[2] + y * closing[3]) / speed2
    along = abs(closing[2] * normal[0] + closing[3] * normal[1]) <= ALONG * speed
    return side if along and abs(side) < FAR_M and 0.0 < time_s < horizon_s else float(np.nan)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def across(sections: Sections, offsets: F64, robot: F64, speed_m_s: float, horizon_s: float, closing: F64) -> F64:
    """Return what it costs to change the side of who comes along the way, shape (n, m), where he still comes by.

    Two lanes beside somebody are often as good as each other, and the noise of a clearance would send the robot from one to the
    other in front of him.  So as soon as it has begun to go to one hand, the other one must be better by that.

    Args:
        sections: from the robot's own on.
        offsets: shape (m,).
        robot: in odom, shape (2,).
        speed_m_s: the fastest that the robot arrives with.
        horizon_s: who comes later does not count.
        closing: middle, velocity and number of cells of the boundary, shape (5,).
    """
    cost = np.zeros((len(sections.at), len(offsets)))
    side = side_of(robot, sections.normal[0], horizon_s, closing)
    if not abs(side) > COMMITTED_M:  # nobody comes, or it has not begun
        return cost
    speed2 = closing[2] * closing[2] + closing[3] * closing[3]
    left_x, left_y = -closing[3] / np.sqrt(speed2), closing[2] / np.sqrt(speed2)
    for i in range(len(sections.at)):
        for j in range(len(offsets)):
            x = sections.at[i, 0] + offsets[j] * sections.normal[i, 0]
            y = sections.at[i, 1] + offsets[j] * sections.normal[i, 1]
            first = EARLY * np.hypot(x - robot[0], y - robot[1]) / speed_m_s if i > 0 else 0.0
            passes = ((x - closing[0]) * closing[2] + (y - closing[1]) * closing[3]) / speed2
            if passes > first and side * ((x - closing[0]) * left_x + (y - closing[1]) * left_y) < 0.0:
                cost[i, j] = CROSS if i > 0 else BEGIN
    return cost


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def station_costs(rho: F64, apart: F64, offsets: F64, demand: Demand) -> F64:
    """Return what it costs to pass each station at each offset, shape (n, m), in metres of clearance missed.

    Args:
        rho: predicted clearances, shape (n, m).
        apart: distances to what closes in, on arrival, shape (n, m).
        offsets: shape (m,).
        demand: what a station must have.
    """
    cost = np.empty(rho.shape)
    for i in range(rho.shape[0]):
        for j in range(rho.shape[1]):
            short = max(0.0, demand.kept_m - rho[i, j])
            room = min(rho[i, j], apart[i, j])
            narrow = min(max(0.0, demand.ample_m - room) / (demand.ample_m - demand.kept_m), 1.0)
            cost[i, j] = -worth(room, offsets[j], demand) + 20.0 * short + NARROW * narrow
    return cost


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def cheapest_branch(costs: F64, offsets: F64, spacing_m: F64, start: float, turn: float) -> tuple[F64, float]:
    """Return the branch that costs least, shape (n,) [m], and what it costs.

    A station's best offset taken alone would hop between the two sides of an obstacle from one station to the next; so the
    branch is chosen as a whole, by dynamic programming over stations and offsets, no steeper than `STEEP`.

    Args:
        costs: of every station and offset, shape (n, m).
        offsets: evenly spaced, shape (m,), m > 1.
        spacing_m: between stations, shape (n - 1,).
        start: offset of the robot at the first station.
        turn: cost of a squared slope, per metre.
    """
    n, m = costs.shape
    total, came = np.empty((n, m)), np.zeros((n, m), np.int64)
    apart_m = (offsets[m - 1] - offsets[0]) / (m - 1)
    for j in range(m):
        total[0, j] = costs[0, j] + AWAY * (offsets[j] - start) ** 2
    for i in range(1, n):
        most = max(1, int(STEEP * spacing_m[i - 1] / apart_m))
        for j in range(m):
            best, before = np.inf, 0
            for k in range(max(0, j - most), min(m, j + most + 1)):
                step = offsets[j] - offsets[k]
                value = total[i - 1, k] + turn * step * step / spacing_m[i - 1]
                if value < best:
                    best, before = value, k
            total[i, j], came[i, j] = best + costs[i, j], before
    y = np.empty(n)
    j = int(np.argmin(total[n - 1]))
    least = total[n - 1, j]
    for back in range(n):
        y[n - 1 - back] = offsets[j]
        j = came[n - 1 - back, j]
    return y, least


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def cost_along(costs: F64, offsets: F64, spacing_m: F64, start: float, turn: float, y: F64) -> float:
    """Return what a branch, shape (n,), costs, as `cheapest_branch` counts."""
    n, m = costs.shape
    total, before = 0.0, 0
    for i in range(n):
        j = int(min(max(np.rint((y[i] - offsets[0]) / (offsets[1] - offsets[0])), 0.0), m - 1.0))
        total += costs[i, j]
        if i == 0:
            total += AWAY * (offsets[j] - start) ** 2
        else:
            step = offsets[j] - offsets[before]
            total += turn * step * step / spacing_m[i - 1]
        before = j
    return total


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def repair(ground: Ground, sections: Sections, i: int, y: float, tube_m: float, hysteresis: float, demand: Demand) -> float:
    """Return the offset near `y` with the best clearance, a metre off costing `hysteresis`; NaN where none is wide enough."""
    low, high = max(y - tube_m, sections.reach[i, 0]), min(y + tube_m, sections.reach[i, 1])
    best, found = -np.inf, np.nan
    for k in range(2 * _FINE + 1):
        at = low + (high - low) * k / (2.0 * _FINE)
        rho = clearance_at(ground, sections, i, at)
        value = worth(rho, at, demand) - hysteresis * abs(at - y)
        if rho >= demand.least_m and value > best:
            best, found = value, at
    return found


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def boxes(ground: Ground, sections: Sections, inside: F64, step_m: float, demand: Demand) -> F64:
    """Return `box_around` of every station, shape (n, 3); NaN where `inside`, shape (n,), is NaN or too narrow."""
    found = np.full((len(inside), 3), np.nan)
    for i in range(len(inside)):
        if np.isfinite(inside[i]) and clearance_at(ground, sections, i, inside[i]) >= demand.least_m:
            found[i] = box_around(ground, sections, i, inside[i], step_m, demand)
    return found


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def repair_all(
    ground: Ground, sections: Sections, predicted: F64, tubes_m: F64, own: int, hysteresis: float, demand: Demand
) -> tuple[F64, int]:
    """Return repaired offsets, shape (n,), NaN where there is none, and how many from `own` on are repaired without gap."""
    n = len(predicted)
    y = np.full(n, np.nan)
    for i in range(n):
        y[i] = repair(ground, sections, i, predicted[i], tubes_m[i], hysteresis, demand)
    good = own
    while good < n and np.isfinite(y[good]):
        good += 1
    return y, good - own


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def along_manifold(ground: Ground, points: F64) -> F64:
    """Return the predicted clearance at points in odom, shape (n, 2), as shape (n,) [m]."""
    rho = np.empty(len(points))
    for i in range(len(points)):
        rho[i] = bilinear(ground.clearance, ground.x_m, ground.y_m, ground.cell_m, points[i, 0], points[i, 1])
    return rho
