"""The slots in which who closes in is kept: what is seen goes to its own, and who is not seen goes on in his, or is forgotten.

A slot is a row: his middle in odom [m], velocity [m/s], number of cells (0: it is empty), for how long his velocity was seen (-1:
not yet), and for how long he was not since [s], and the covariance of place and velocity, four rows of four.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import F32, F64
from estimators.field_query import bilinear
from planners.clearance_manifold.motion_kernels import CELLS, SEEN_S, UNSEEN_S, go_on, see, surely_moves

FREE_AROUND_M = 0.45  # a place in view with so much clearance is nobody's
SURE_S = 0.3  # what was seen to close in for less is the noise of a rate
SURE = 2.0  # and so is a velocity of less than so many standard deviations: a wall seen while turning has rates, too
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
        found: what is seen to close in, the nearest first, shape (m, FOUND), m <= n.
        clearance: now, shape (rows, columns) [m].
        age_s: since each of its cells was looked at, shape (rows, columns).
        corner: of the field, in odom, shape (2,).
        cell_m: its cells.
        carry_s: for how long one is carried on.
        elapsed_s: since the last time.
    """
    for k in range(len(slots)):
        go_on(slots[k], elapsed_s)
    taken = np.zeros(len(slots), np.bool_)
    where = _known(slots, found, taken)
    for one in range(len(found)):
        begins = where[one] < 0
        if begins:
            where[one] = _least_worth(slots, taken, carry_s)
            taken[where[one]] = True
        see(slots[where[one]], found[one], elapsed_s, begins)
    for k in range(len(slots)):
        if not taken[k] and slots[k, CELLS] > 0.0:
            _carry(slots[k], found, clearance, age_s, corner, cell_m, carry_s, elapsed_s)
    out = np.zeros((len(slots), 5))
    for k in range(len(slots)):
        counts = slots[k, CELLS] > 0.0 and (sure(slots[k]) or (len(found) > 0 and where[0] == k and slots[k, SEEN_S] >= 0.0))
        if counts and np.hypot(slots[k, 2], slots[k, 3]) > STILL_M_S:
            out[k] = slots[k, :5]
    return out


@kernel()
def sure(slot: F64) -> bool:
    """Return whether it was seen for long enough that who is in a slot, shape (WIDTH,), closes in."""
    return bool(slot[SEEN_S] >= SURE_S and surely_moves(slot, SURE))


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
