"""How who closes in moves, by all that was seen of him: a Kalman filter of constant velocity, of a row of `closing_kernels`.

A rate says something of the velocity along the slopes only that it was seen beside: a front that comes on, beside a wall or at
the edge of view, says nothing of what leads along it.  And the middle of what is seen moves as he does, but also as more of him
comes into view, or as he joins something else, and that for as long as it lasts.  So each counts along each direction for as
much as it says there, and what is far from what is expected for less.
"""

from __future__ import annotations

import numpy as np

from drivers.interface.kernel import kernel
from estimators.belief import F64
from planners.clearance_manifold.boundary_kernels import SCATTER, SHARE, SLOPES

CELLS, SEEN_S, UNSEEN_S, COVARIANCE, WIDTH = 4, 5, 6, 7, 23
WALKS_M_S = 0.7  # of somebody of whom nothing else is known, along x and y
SWERVE_M_S = 0.5  # by which its velocity wanders in a second
RATE_M_S = 0.5  # noise of the velocity that rates give,
RATE_S = 0.56  # which are the same for so long
MIDDLE_M = 0.08  # noise of a boundary's middle, where all of its cells give a velocity; where fewer do, there is more beside it
LEAST_SHARE = 0.02  # or it lies at the edge of view, and this is the least
MIDDLE_S = 0.05  # it is the same for so long
LEAST_SLOPES = 0.05  # mean square of the slopes along a direction of which rates say anything
FAR = 3.0  # what is off by more standard deviations than this counts as if it were less exact


@kernel()
def go_on(slot: F64, elapsed_s: float) -> None:
    """Move who is in a slot, shape (WIDTH,), on with the velocity that he has."""
    slot[0] += elapsed_s * slot[2]
    slot[1] += elapsed_s * slot[3]


@kernel()
def surely_moves(slot: F64, sure: float) -> bool:
    """Return whether the velocity in a slot is more than so many of the standard deviations that it has along itself."""
    spread, vx, vy = slot[COVARIANCE:].reshape((4, 4)), slot[2], slot[3]
    speed2 = vx * vx + vy * vy
    along = spread[2, 2] * vx * vx + 2.0 * spread[2, 3] * vx * vy + spread[3, 3] * vy * vy
    return bool(speed2 * speed2 >= sure * sure * along)


@kernel()
def see(slot: F64, who: F64, elapsed_s: float, begins: bool) -> None:
    """Take in what is seen, shape (FOUND,), of who is in a slot, shape (WIDTH,), after he went on, or comes into it."""
    spread, rated = slot[COVARIANCE:].reshape((4, 4)), who[SHARE] > 0.0
    if begins:
        _begin(slot, spread, who)
    elif elapsed_s > 0.0:
        _spread(spread, elapsed_s)
        share = max(LEAST_SHARE, who[SHARE])
        larger = max(1.0, MIDDLE_S / elapsed_s) / share
        _weigh(slot, spread, 0, who[:2], larger * who[SCATTER : SCATTER + 3], larger * MIDDLE_M**2)
    if rated and (begins or elapsed_s > 0.0):
        noise = RATE_M_S**2 * (1.0 if slot[SEEN_S] < 0.0 else max(1.0, RATE_S / max(elapsed_s, 1e-9)))
        _weigh_rates(slot, spread, who, noise)
    if slot[SEEN_S] >= 0.0:
        slot[SEEN_S] += elapsed_s
    elif rated:
        slot[SEEN_S] = 0.0
    slot[CELLS], slot[UNSEEN_S] = who[CELLS], 0.0


@kernel()
def _begin(slot: F64, spread: F64, who: F64) -> None:
    """Put somebody into a slot of whom only the place is known."""
    slot[0], slot[1], slot[2], slot[3], slot[SEEN_S] = who[0], who[1], 0.0, 0.0, -1.0
    spread[:] = 0.0
    spread[0, 0], spread[0, 1] = MIDDLE_M**2 + who[SCATTER], who[SCATTER + 1]
    spread[1, 0], spread[1, 1] = who[SCATTER + 1], MIDDLE_M**2 + who[SCATTER + 2]
    spread[2, 2] = spread[3, 3] = WALKS_M_S**2


@kernel()
def _spread(spread: F64, elapsed_s: float) -> None:
    """Let the covariance, shape (4, 4), grow as somebody goes on whose velocity wanders."""
    spread[:2, :] += elapsed_s * spread[2:, :]
    spread[:, :2] += elapsed_s * spread[:, 2:]
    spread[2, 2] += SWERVE_M_S**2 * elapsed_s
    spread[3, 3] += SWERVE_M_S**2 * elapsed_s


@kernel()
def _weigh(slot: F64, spread: F64, what: int, seen: F64, scatter: F64, noise: float) -> None:
    """Correct by a place (what 0) that is seen, shape (2,), along either axis of its scatter xx, xy, yy."""
    c, s, first, second = _axes(scatter)
    _correct(slot, spread, what, c, s, c * seen[0] + s * seen[1], noise + first)
    _correct(slot, spread, what, -s, c, c * seen[1] - s * seen[0], noise + max(0.0, second))


@kernel()
def _weigh_rates(slot: F64, spread: F64, who: F64, noise: float) -> None:
    """Correct by the velocity that rates give, along either axis of the slopes, as far as there are slopes along it."""
    c, s, first, second = _axes(who[SLOPES : SLOPES + 3])
    if first > LEAST_SLOPES:
        _correct(slot, spread, 2, c, s, c * who[2] + s * who[3], 0.5 * noise / first)
    if second > LEAST_SLOPES:
        _correct(slot, spread, 2, -s, c, c * who[3] - s * who[2], 0.5 * noise / second)


@kernel()
def _axes(products: F64) -> tuple[float, float, float, float]:
    """Return the direction of the longer axis of a symmetric matrix xx, xy, yy, and its value along that and across."""
    a, b, d = products
    half, root, angle = 0.5 * (a + d), np.hypot(0.5 * (a - d), b), 0.5 * np.arctan2(2.0 * b, a - d)
    return np.cos(angle), np.sin(angle), half + root, half - root


@kernel()
def _correct(slot: F64, spread: F64, what: int, along_x: float, along_y: float, value: float, noise: float) -> None:
    """Correct by one component of place (what 0) or velocity (what 2), along a unit vector."""
    off = value - along_x * slot[what] - along_y * slot[what + 1]
    both = along_x * spread[what] + along_y * spread[what + 1]
    own = along_x * both[what] + along_y * both[what + 1]
    noise *= max(1.0, off * off / (FAR * FAR * (own + noise)))
    gain = both / (own + noise)
    slot[:4] += off * gain
    for i in range(4):
        spread[i] -= gain[i] * both
