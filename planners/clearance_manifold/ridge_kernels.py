"""Cross-sections of the predicted field: the ridge, the box around it, and its repair from tick to tick."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drivers.interface.kernel import kernel
from estimators.belief import F32, F64
from estimators.field_query import bilinear

_FINE = 5  # samples of a tube, to either side


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


@kernel()
def clearance_at(ground: Ground, sections: Sections, i: int, y: float) -> float:
    """Return rho(xi_i, y) [m]."""
    value: float = bilinear(
        ground.clearance, ground.x_m, ground.y_m, ground.cell_m,
        sections.at[i, 0] + y * sections.normal[i, 0], sections.at[i, 1] + y * sections.normal[i, 1],
    )  # fmt: skip
    return value


@kernel()
def worth(clearance: float, y: float, demand: Demand) -> float:
    """Return how good a ridge is: clearance as far as it counts, nearness to the centre line where it is enough."""
    return min(clearance, demand.enough_m) - demand.centring * abs(y)


@kernel()
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


@kernel()
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


@kernel()
def profiles(ground: Ground, sections: Sections, offsets: F64) -> F64:
    """Return rho at every station and offset, shape (n, m); -1 beyond a section's reach."""
    rho = np.full((len(sections.at), len(offsets)), -1.0)
    for i in range(rho.shape[0]):
        for j in range(rho.shape[1]):
            y = offsets[j]
            if sections.reach[i, 0] <= y <= sections.reach[i, 1]:
                rho[i, j] = clearance_at(ground, sections, i, y)
    return rho


@kernel()
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


@kernel()
def boxes(ground: Ground, sections: Sections, inside: F64, step_m: float, demand: Demand) -> F64:
    """Return `box_around` of every station, shape (n, 3); NaN where `inside`, shape (n,), is NaN or too narrow."""
    found = np.full((len(inside), 3), np.nan)
    for i in range(len(inside)):
        if np.isfinite(inside[i]) and clearance_at(ground, sections, i, inside[i]) >= demand.least_m:
            found[i] = box_around(ground, sections, i, inside[i], step_m, demand)
    return found


@kernel()
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


@kernel()
def along_manifold(ground: Ground, points: F64) -> F64:
    """Return the predicted clearance at points in odom, shape (n, 2), as shape (n,) [m]."""
    rho = np.empty(len(points))
    for i in range(len(points)):
        rho[i] = bilinear(ground.clearance, ground.x_m, ground.y_m, ground.cell_m, points[i, 0], points[i, 1])
    return rho
