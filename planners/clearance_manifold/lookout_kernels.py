"""How soon somebody who is not seen could step into the robot's way: rays across the corridor, and openings along it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drivers.interface.kernel import kernel
from estimators.belief import F32, F64, Mask


class Unseen(NamedTuple):
    """Who may come out of what is not seen."""

    speed_m_s: float
    apart_m: float  # between him and the robot's centre
    width_m: float  # of his body
    side_m: float  # how far to the sides is looked


class Seen(NamedTuple):
    """What is known, and since when."""

    known: Mask  # (rows, columns)
    clearance: F32  # (rows, columns) [m]
    age_s: F32  # (rows, columns), since each cell was last in view
    x_m: float  # lower corner in odom
    y_m: float
    cell_m: float


@kernel()
def arrival(seen: Seen, x: float, y: float, out_x: float, out_y: float, unseen: Unseen) -> tuple[float, float]:
    """Return when somebody unseen can be `apart_m` from a point, coming along a ray, and from how far out [s, m].

    Walking inwards, he is at cell k at E_k = max(E_{k+1} + step / speed, -age_k) at the earliest: not before he can have got
    there, and not while it was seen to be free.  In an unknown cell he may be at any time, through an occupied one he cannot
    come.

    Args:
        seen: what is known.
        x: of the point in odom [m].
        y: likewise.
        out_x: unit vector outwards.
        out_y: likewise.
        unseen: how fast he is.

    Returns:
        The time from now, negative or -inf where he may be there already, inf where nobody can come; and the distance of the
        nearest place that is out of view.
    """
    rows, columns = seen.known.shape
    step = 0.5 * seen.cell_m
    count = int(unseen.side_m / step)
    ages = np.empty(count)
    end, reached, out_of_view = -np.inf, 0, unseen.side_m
    for k in range(count):
        d = (k + 1) * step
        row = int(np.floor((y + d * out_y - seen.y_m) / seen.cell_m))
        column = int(np.floor((x + d * out_x - seen.x_m) / seen.cell_m))
        inside = 0 <= row < rows and 0 <= column < columns
        if inside and seen.clearance[row, column] <= 1.01 * seen.cell_m:
            end = np.inf
            break
        if not inside or not seen.known[row, column]:
            out_of_view = min(out_of_view, d)
            if d > unseen.apart_m:
                break
            ages[k] = 0.0  # so near, the robot's own body and the blind zone of its camera hide it
        else:
            ages[k] = seen.age_s[row, column]
            if ages[k] > 0.0:
                out_of_view = min(out_of_view, d)
        reached = k + 1
    for k in range(reached - 1, -1, -1):
        if (k + 1) * step <= unseen.apart_m:
            break
        end = max(end + step / unseen.speed_m_s, -ages[k])
    return end, out_of_view


@kernel()
def arrivals(seen: Seen, at: F64, normal: F64, spacing_m: float, unseen: Unseen) -> tuple[F64, F64]:
    """Return when somebody can come from the right and from the left of points, and from how far out, each shape (n, 2).

    He is as wide as `width_m`: where one of the rays that he takes up was seen to be free, or is closed, he is not.

    Args:
        seen: what is known.
        at: points in odom, shape (n, 2).
        normal: unit, to the left, shape (n, 2).
        spacing_m: between the points.
        unseen: who may come.
    """
    n = len(at)
    ray, whence, when = np.empty((n, 2)), np.empty((n, 2)), np.full((n, 2), np.inf)
    taken = max(1, int(np.ceil(unseen.width_m / spacing_m)))
    for side in range(2):
        sign = 1.0 if side else -1.0
        for i in range(n):
            ray[i, side], whence[i, side] = arrival(seen, at[i, 0], at[i, 1], sign * normal[i, 0], sign * normal[i, 1], unseen)
        for first in range(1 - taken, n):
            begin, end = max(first, 0), min(first + taken, n)
            hidden = ray[begin:end, side].max()
            for i in range(begin, end):
                when[i, side] = min(when[i, side], hidden)
    return when, whence


@kernel()
def openings(when: F64, arcs_m: F64, unseen: Unseen) -> F64:
    """Return the stretches of the way that somebody can step into: where they begin and end, and when he may be there.

    Args:
        when: from the right and from the left, shape (n, 2) [s].
        arcs_m: of the rays, shape (n,), evenly spaced.
        unseen: how far off the robot must stay.

    Returns:
        shape (m, 3) [m, m, s], in order; those that meet are one.  What lies behind the robot is past.  Where no wall follows
        there is no opening but open ground, on which walkers are seen to come.
    """
    n, half = len(arcs_m), 0.5 * (arcs_m[1] - arcs_m[0])
    found, count, i = np.empty((n, 3)), 0, 0
    while i < n:
        first, soonest = i, np.inf
        while i < n and min(when[i, 0], when[i, 1]) < np.inf:
            soonest = min(soonest, when[i, 0], when[i, 1])
            i += 1
        if i == first:
            i += 1
        elif i < n and arcs_m[i - 1] > -half:
            begin, end = arcs_m[first] - half - unseen.apart_m, arcs_m[i - 1] + half + unseen.apart_m
            if count > 0 and begin <= found[count - 1, 1]:
                found[count - 1, 1], found[count - 1, 2] = end, min(found[count - 1, 2], soonest)
            else:
                found[count, 0], found[count, 1], found[count, 2] = begin, end, soonest
                count += 1
    return found[:count]
