"""The slots in which who closes in is kept: what is seen goes to its own, and who is not seen goes on in his, or is forgotten.

A slot is a row of ten: his middle in odom [m], velocity [m/s], number of cells (0: it is empty), the variance of his place [m2],
its covariance with his velocity, the variance of that, for how long he was seen, and for how long he was not since [s].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import F32, F64
from estimators.field_query import bilinear

CELLS, PLACE, BOTH, SPEED, SEEN_S, UNSEEN_S, WIDTH = 4, 5, 6, 7, 8, 9, 10
FREE_AROUND_M = 0.45  # a place in view with so much clearance is nobody's
SURE_S = 0.3  # what was seen to close in for less is the noise of a rate
SURE = 2.0  # and so is a velocity of less than so many standard deviations: a wall seen while turning has rates, too
FIRST = 0.5  # share of the velocity that the first rates of something new give: what comes into view has any rate
MIDDLE_M = 0.08  # noise of a boundary's middle
RATE_M_S = 0.5  # and of the velocity that its rates give,
RATE_S = 0.56  # which are the same for so long: the smoothing of the field rate
FASTEST_M_S = 1.5  # and nobody walks faster
SWERVE_M_S = 0.5  # by which its velocity wanders in a second
STILL_M_S = 0.15  # what moves no faster does not close in
SAME_M = 0.5  # from one time to the next, what is nearer than this to where it must be is the same


@kernel()
def remember(
    slots: F64, found: F64, clearance: F32, age_s: F32, corner: F64, cell_m: float, carry_s: float, elapsed_s: float
) -> F64:
    """Bring the slots, shape (n, WIDTH), up to what is seen; return middle, velocity and cells of who closes in, shape (n, 5).

    Of what was not seen to for long enough to be sure only the nearest counts: most of that is noise.

    Args:
        slots: changed in place.
        found: what is seen to close in, the nearest first, shape (m, 5), m <= n.
        clearance: now, shape (rows, columns) [m].
        age_s: since each of its cells was looked at, shape (rows, columns).
        corner: of the field, in odom, shape (2,).
        cell_m: its cells.
        carry_s: for how long one is carried on.
        elapsed_s: since the last time.
    """
    slots[:, 0] += elapsed_s * slots[:, 2]
    slots[:, 1] += elapsed_s * slots[:, 3]
    taken = np.zeros(len(slots), np.bool_)
    where = _known(slots, found, taken)
    for one in range(len(found)):
        begins = where[one] < 0
        if begins:
            where[one] = _least_worth(slots, taken, carry_s)
            taken[where[one]] = True
        _see(slots[where[one]], found[one], elapsed_s, begins)
    for k in range(len(slots)):
        if not taken[k] and slots[k, CELLS] > 0.0:
            _carry(slots[k], found, clearance, age_s, corner, cell_m, carry_s, elapsed_s)
    out = np.zeros((len(slots), 5))
    for k in range(len(slots)):
        counts = (slots[k, CELLS] > 0.0 and sure(slots[k])) or (len(found) > 0 and where[0] == k)
        if counts and np.hypot(slots[k, 2], slots[k, 3]) > STILL_M_S:
            out[k] = slots[k, :5]
    return out


@kernel()
def sure(slot: F64) -> bool:
    """Return whether it was seen for long enough that who is in a slot, shape (WIDTH,), closes in."""
    return bool(slot[SEEN_S] >= SURE_S and np.hypot(slot[2], slot[3]) >= SURE * np.sqrt(slot[SPEED]))


@kernel()
def _known(slots: F64, found: F64, taken: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return in which slot each that is seen is, -1 in none, shape (m,); those are taken."""
    where = np.full(len(found), -1)
    for one in range(len(found)):
        nearest_m = SAME_M
        for k in range(len(slots)):
            off_m = np.hypot(found[one, 0] - slots[k, 0], found[one, 1] - slots[k, 1])
            if slots[k, CELLS] > 0.0 and not taken[k] and off_m < nearest_m:
                where[one], nearest_m = k, off_m
        if where[one] >= 0:
            taken[where[one]] = True
    return where


@kernel()
def _least_worth(slots: F64, taken: NDArray[np.bool_], carry_s: float) -> int:
    """Return an empty slot, or that of who was not seen for longest, among those not taken."""
    least, worth_s = -1, np.inf
    for k in range(len(slots)):
        left_s = carry_s - slots[k, UNSEEN_S] if slots[k, CELLS] > 0.0 else -np.inf
        if not taken[k] and left_s < worth_s:
            least, worth_s = k, left_s
    return least


@kernel()
def _see(slot: F64, who: F64, elapsed_s: float, begins: bool) -> None:
    """Take in what is seen, shape (5,), of who is in a slot, shape (WIDTH,), or comes into it."""
    slower = min(1.0, FASTEST_M_S / max(np.hypot(who[2], who[3]), 1e-9))
    vx, vy = who[2] * slower, who[3] * slower
    if begins:
        slot[:CELLS] = who[0], who[1], FIRST * vx, FIRST * vy
        slot[PLACE], slot[BOTH], slot[SPEED], slot[SEEN_S] = MIDDLE_M**2, 0.0, FIRST * RATE_M_S**2, 0.0
    elif elapsed_s > 0.0:
        drift = SWERVE_M_S**2 * elapsed_s
        slot[PLACE] += elapsed_s * (2.0 * slot[BOTH] + elapsed_s * slot[SPEED])
        slot[BOTH] += elapsed_s * slot[SPEED]
        slot[SPEED] += drift
        _weigh(slot, 0, who[0], who[1], MIDDLE_M**2)
        _weigh(slot, 2, vx, vy, RATE_M_S**2 * max(1.0, RATE_S / elapsed_s))
        slot[SEEN_S] += elapsed_s
    slot[CELLS], slot[UNSEEN_S] = who[4], 0.0


@kernel()
def _weigh(slot: F64, what: int, x: float, y: float, noise: float) -> None:
    """Correct place and velocity, which the same gains hold for in x and y, by a place (what 0) or a velocity (what 2)."""
    place, speed = (slot[PLACE], slot[BOTH]) if what == 0 else (slot[BOTH], slot[SPEED])
    spread = (slot[PLACE] if what == 0 else slot[SPEED]) + noise
    gain_place, gain_speed = place / spread, speed / spread
    off_x, off_y = x - slot[what], y - slot[what + 1]
    slot[0] += gain_place * off_x
    slot[1] += gain_place * off_y
    slot[2] += gain_speed * off_x
    slot[3] += gain_speed * off_y
    slot[PLACE] -= gain_place * place
    slot[BOTH] -= gain_place * speed
    slot[SPEED] -= gain_speed * speed


@kernel()
def _carry(
    slot: F64, found: F64, clearance: F32, age_s: F32, corner: F64, cell_m: float, carry_s: float, elapsed_s: float
) -> None:
    """Let who is not seen to close in go on, or forget him: where his place is free, or somebody else is seen there.

    Where his place is in view, as before a wall, he is carried on for `SURE_S` only.
    """
    in_view = bilinear(age_s, corner[0], corner[1], cell_m, slot[0], slot[1]) == 0.0
    free = bilinear(clearance, corner[0], corner[1], cell_m, slot[0], slot[1]) > FREE_AROUND_M
    slot[UNSEEN_S] += elapsed_s * (max(1.0, carry_s / SURE_S) if in_view else 1.0)
    forgotten = not sure(slot) or slot[UNSEEN_S] > carry_s or (in_view and free)
    for one in range(len(found)):
        forgotten = forgotten or np.hypot(found[one, 0] - slot[0], found[one, 1] - slot[1]) < SAME_M
    if forgotten:
        slot[:CELLS] = 0.0
        slot[CELLS], slot[SEEN_S] = 0.0, 0.0
