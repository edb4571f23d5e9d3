"""Risk of every command over its clearances: the tail, and the mean of all scenarios.

Source: Han, Zhu, RCSP, section 4.3, algorithm 1 (line 5).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from planners.risk import count_within, gather_smallest

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

INVERSE_CLEARANCE, VIOLATION, NEAR_MISS = 0, 1, 2


class Risk(NamedTuple):
    """g_risk as a function of clearance; it falls with it, so that its maximum over the horizon is at the least clearance."""

    kind: int
    safe_m: float  # beyond it there is no risk
    collision: float
    depth_m: float


@kernel()
def risk_of(clearance_m: float, safe_m: float, risk: Risk) -> float:
    """Return g_risk, in [0, `largest(risk)`]: zero from safe_m on.

    - violation: 1 - c / safe, down to an overlap of depth_m;
    - inverse clearance: safe / c - 1 down to the clearance at which it has grown to the collision penalty;
    - near miss: (1 - c / safe)^2, and where surfaces meet the penalty of a collision and the overlap on top.
    """
    c = max(clearance_m, -risk.depth_m)
    if c >= safe_m:
        return 0.0
    if risk.kind == VIOLATION:
        return 1.0 - c / safe_m
    if risk.kind == INVERSE_CLEARANCE:
        least = safe_m / (1.0 + risk.collision)
        return safe_m / max(c, least) - 1.0 + max(0.0, -c) / risk.depth_m
    if c >= 0.0:
        return (1.0 - c / safe_m) * (1.0 - c / safe_m)
    return 1.0 + risk.collision - c / risk.depth_m


def largest(risk: Risk, safe_m: float) -> float:
    """Return B_G, the largest risk there is."""
    return float(risk_of(-np.inf, safe_m, risk))


@kernel()
def tails(
    clearance: F32, static_m: F32, brakable: NDArray[np.bool_], count: int, risk: Risk, static_safe_m: float
) -> tuple[F64, F64, NDArray[np.bool_]]:
    """Return of every command: the mean risk of its tail, the tail's mean clearance, and whether it is free.

    The tail is the `count` scenarios of least clearance.  A command from which the robot cannot brake in time for what stands
    still collides in every scenario.

    Args:
        clearance: shape (commands, scenarios).
        static_m: clearance to what stands still, shape (commands,).
        brakable: shape (commands,).
        count: of scenarios in the tail.
        risk: of what moves, and in its form of what stands still.
        static_safe_m: clearance beyond which what stands still is no risk.

    Returns:
        Shapes (commands,); free is what meets an obstacle, under way or where it then stands, in fewer than `count` scenarios.
    """
    commands, n = clearance.shape
    tail, room, free = np.empty(commands), np.empty(commands), np.empty(commands, np.bool_)
    row = np.empty(n + 1, np.float32)  # its tail
    below_safe = np.nextafter(np.float32(risk.safe_m), np.float32(-1.0))
    for u in range(commands):
        floor = risk_of(static_m[u] if brakable[u] else -np.inf, static_safe_m, risk)
        tail[u], room[u], free[u] = floor, min(risk.safe_m, static_m[u]), brakable[u]
        if n == 0 or count_within(clearance[u], below_safe) == 0.0:
            continue
        gather_smallest(clearance[u], count, row)
        total, width, edge = 0.0, 0.0, row[0]
        for i in range(count):
            total += max(floor, risk_of(row[i], risk.safe_m, risk))
            width += row[i]
            edge = max(edge, row[i])
        tail[u], room[u], free[u] = total / count, min(width / count, static_m[u]), edge > 0.0 and brakable[u]
    return tail, room, free


@kernel()
def risks_of(clearance: F32, safe_m: float, risk: Risk, risks: F64) -> None:
    """Write `risk_of` clearances, shape (n,), into risks, shape (n,).

    Near misses and collisions are mixed without an order that a processor could guess: both are worked out, with one division,
    by a loop that is vectorised.
    """
    if risk.kind != NEAR_MISS:
        for i in range(len(risks)):
            risks[i] = risk_of(clearance[i], safe_m, risk)
        return
    deepest, touch, depth = -risk.depth_m, 1.0 + risk.collision, risk.depth_m
    for i in range(len(risks)):
        c = float(clearance[i])
        c = c if c > deepest else deepest
        share = c / (safe_m if c >= 0.0 else depth)
        near = (1.0 - share) * (1.0 - share) if c >= 0.0 else touch - share
        risks[i] = near if c < safe_m else 0.0


@kernel()
def mean_risks(clearance: F32, static_m: F32, brakable: NDArray[np.bool_], risk: Risk, static_safe_m: float) -> F64:
    """Return the mean risk of every command over the scenarios, shape (commands,); the arguments are those of `tails`.

    Who is touched where it stands after the horizon, at a clearance of zero, has time to leave, but maybe no way: it is taken
    for half a collision.
    """
    commands, n = clearance.shape
    mean, trapped = np.empty(commands), 0.5 * (risk_of(0.0, risk.safe_m, risk) + risk_of(-1e-6, risk.safe_m, risk))
    risks = np.empty(n)
    for u in range(commands):
        floor, row = risk_of(static_m[u] if brakable[u] else -np.inf, static_safe_m, risk), clearance[u]
        risks_of(row, risk.safe_m, risk, risks)
        for i in range(n):
            g = trapped if row[i] == 0.0 else risks[i]
            risks[i] = g if g > floor else floor
        total = 0.0
        for i in range(n):
            total += risks[i]
        mean[u] = total / n if n else floor
    return mean
