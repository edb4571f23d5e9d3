"""Which way round what stands and what closes in: the branch, chosen for all cross-sections at once."""

from __future__ import annotations

import numpy as np

from drivers.interface.kernel import kernel
from estimators.belief import F64
from planners.clearance_manifold.ridge_kernels import Demand, Sections, worth

BODY_M = 0.33  # from the middle of who closes in to his sides, and by how much where he is may be wrong
NARROW = 5.0  # cost of a station where the shield would stop; less, the nearer it is to ample
EARLY = 0.7  # of the time to a place: the robot may be there so early
STEEP = 2.0  # no branch is steeper: from one station to the next it would lead through what stands between them
AWAY = 4.0  # cost of a squared distance between the robot and its own station, per square metre


@kernel()
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
        closing: middle, velocity and number of cells (0: nothing) of each that closes in, shape (k, 5).
    """
    apart = np.full((len(sections.at), len(offsets)), np.inf)
    for k in range(len(closing)):
        if closing[k, 4] == 0.0:
            continue
        who_x, who_y, vx, vy = closing[k, 0], closing[k, 1], closing[k, 2], closing[k, 3]
        speed2 = max(vx * vx + vy * vy, 1e-6)
        for i in range(len(sections.at)):
            for j in range(len(offsets)):
                x = sections.at[i, 0] + offsets[j] * sections.normal[i, 0]
                y = sections.at[i, 1] + offsets[j] * sections.normal[i, 1]
                first = min(EARLY * np.hypot(x - robot[0], y - robot[1]) / speed_m_s, horizon_s)
                nearest = ((x - who_x) * vx + (y - who_y) * vy) / speed2
                t = min(max(nearest, first), horizon_s)
                apart[i, j] = min(apart[i, j], np.hypot(x - who_x - vx * t, y - who_y - vy * t) - BODY_M)
    return apart


@kernel()
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


@kernel()
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


@kernel()
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
