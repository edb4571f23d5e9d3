"""What closes in: how fast by all that was seen of it, and where it must be for a moment after it left the view.

Beyond the paper, whose field rate is zero outside of what is seen again and again.  A rate is smoothed and so late, and the
end of a wall that comes into view has one like somebody who steps out of it; but a wall stays where it is.  So the velocity
that slopes and rates give is weighed against how the boundary's middle really moves (Kalman filter, constant velocity).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.belief import F32, F64, ClearanceField, Mask
from estimators.field_query import sample

FREE_AROUND_M = 0.45  # a place in view with so much clearance is nobody's
SURE_S = 0.3  # what was seen to close in for less is the noise of a rate
SURE = 2.0  # and so is a velocity of less than so many standard deviations: a wall seen while turning has rates, too
FIRST = 0.5  # share of the velocity that the first rates of something new give: what comes into view has any rate
MIDDLE_M = 0.08  # noise of a boundary's middle
RATE_M_S = 0.5  # and of the velocity that its rates give,
FASTEST_M_S = 1.5  # and nobody walks faster
RATE_S = 0.56  # which are the same for so long: the smoothing of the field rate
SWERVE_M_S = 0.5  # by which its velocity wanders in a second
STILL_M_S = 0.15  # what moves no faster does not close in
SLOTS = 3  # so many are kept in mind
SAME_M = 0.5  # from one time to the next, what is nearer than this to where it must be is the same


class ClosingMemory:
    """The boundaries that close in, or did last, each moved on with the velocity it has: `SLOTS` of however many."""

    def __init__(self, carry_s: float) -> None:
        """Take for how long one is carried on."""
        self._carry_s = carry_s
        self._kept: F64 = np.zeros((SLOTS, 5))  # as `nearest_closing` gives them; 0 cells: an empty slot
        self._spread: F64 = np.zeros((SLOTS, 3))  # variance of a place, covariance with its velocity, and that one's variance
        self._seen_s, self._unseen_s = np.zeros(SLOTS), np.zeros(SLOTS)

    @property
    def begins(self) -> Mask:
        """Whether what is in a slot is another than at the time before, shape (SLOTS,)."""
        return np.asarray(self._seen_s == 0.0)

    def update(self, found: F64, field: ClearanceField, age_s: F32, elapsed_s: float) -> F64:
        """Return what closes in, slot by slot: what is seen to, or where what was seen to must be by now; shape (SLOTS, 5).

        Of what was not seen to for long enough to be sure only the nearest counts: most of that is noise.

        Args:
            found: what is seen to, the nearest first, shape (n, 5), n <= SLOTS.
            field: the clearance now.
            age_s: since each of its cells was looked at, shape (rows, columns).
            elapsed_s: since the last time.
        """
        self._kept[:, :2] += elapsed_s * self._kept[:, 2:4]
        slots, new = self._slots(found)
        for slot, who, begins in zip(slots, found, new, strict=True):
            self._see(slot, who, elapsed_s, begins=begins)
        for slot in range(SLOTS):
            if slot not in slots and self._kept[slot, 4] > 0.0:
                self._carry(slot, found, field, age_s, elapsed_s)
        counts = np.array([self._kept[slot, 4] > 0.0 and self._sure(slot) for slot in range(SLOTS)])
        counts[slots[:1]] = True
        counts &= np.hypot(self._kept[:, 2], self._kept[:, 3]) > STILL_M_S
        return np.where(counts[:, None], self._kept, 0.0)

    def _slots(self, found: F64) -> tuple[list[int], list[bool]]:
        """Return in which slot each that is seen is or comes, and whether it is new there; shape (n, 5)."""
        slots, off_m = np.full(len(found), -1), np.hypot(*(found[:, None, :2] - self._kept[None, :, :2]).transpose(2, 0, 1))
        off_m[:, self._kept[:, 4] == 0.0] = math.inf
        for one in range(len(found)):
            slot = int(np.argmin(off_m[one]))
            if off_m[one, slot] < SAME_M:
                slots[one], off_m[:, slot] = slot, math.inf
        new = slots < 0
        worth_s = np.where(self._kept[:, 4] > 0.0, self._carry_s - self._unseen_s, -math.inf)
        for one in np.flatnonzero(new).tolist():
            worth_s[slots[slots >= 0]] = math.inf
            slots[one] = int(np.argmin(worth_s))
        return slots.tolist(), new.tolist()

    def _see(self, slot: int, who: F64, elapsed_s: float, *, begins: bool) -> None:
        """Take in what is seen of who is in a slot, shape (5,)."""
        who = np.concatenate((who[:2], _walked(who[2:4]), who[4:]))
        if begins:
            self._kept[slot], self._spread[slot] = who, (MIDDLE_M**2, 0.0, FIRST * RATE_M_S**2)
            self._kept[slot, 2:4] *= FIRST
        else:
            self._weigh(slot, who, elapsed_s)
        self._seen_s[slot] = 0.0 if begins else self._seen_s[slot] + elapsed_s
        self._unseen_s[slot] = 0.0

    def _carry(self, slot: int, found: F64, field: ClearanceField, age_s: F32, elapsed_s: float) -> None:
        """Let who is not seen to close in go on, or forget him: where his place is free, or somebody else is seen there.

        Where his place is in view, as before a wall, he is carried on for `SURE_S` only.
        """
        there = self._kept[None, slot, :2]
        seen = float(sample(age_s, field.lattice, there)[0]) == 0.0
        self._unseen_s[slot] += elapsed_s * (max(1.0, self._carry_s / SURE_S) if seen else 1.0)
        free = float(sample(field.clearance_m, field.lattice, there)[0]) > FREE_AROUND_M
        taken = bool((np.hypot(*(found[:, :2] - there).T) < SAME_M).any())
        if not self._sure(slot) or self._unseen_s[slot] > self._carry_s or (seen and free) or taken:
            self._kept[slot], self._seen_s[slot] = 0.0, 0.0

    def _sure(self, slot: int) -> bool:
        """Return whether it was seen for long enough that who is in a slot closes in."""
        speed = float(np.hypot(*self._kept[slot, 2:4]))
        return bool(self._seen_s[slot] >= SURE_S and speed >= SURE * math.sqrt(self._spread[slot, 2]))

    def _weigh(self, slot: int, found: F64, elapsed_s: float) -> None:
        """Correct position and velocity, which the same gains hold for in x and y, by what is seen now."""
        if elapsed_s <= 0.0:
            return
        kept = self._kept[slot]
        place, both, speed = self._spread[slot]  # variances of position and velocity, and their covariance between them
        drift = SWERVE_M_S**2 * elapsed_s
        place, both, speed = place + elapsed_s * (2.0 * both + elapsed_s * speed), both + elapsed_s * speed, speed + drift
        for index, noise in ((0, MIDDLE_M**2), (2, RATE_M_S**2 * max(1.0, RATE_S / elapsed_s))):
            column = np.array([place, both]) if index == 0 else np.array([both, speed])
            gain = column / ((place if index == 0 else speed) + noise)
            off = found[index : index + 2] - kept[index : index + 2]
            kept[:2] += gain[0] * off
            kept[2:4] += gain[1] * off
            taken = gain[:, None] * column
            place, both, speed = place - taken[0, 0], both - taken[0, 1], speed - taken[1, 1]
        kept[4], self._spread[slot] = found[4], (place, both, speed)

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is carried on, as named arrays."""
        return {"closing": np.column_stack((self._kept, self._spread, self._seen_s, self._unseen_s))}

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._kept, self._spread = state["closing"][:, :5].copy(), state["closing"][:, 5:8].copy()
        self._seen_s, self._unseen_s = state["closing"][:, 8].copy(), state["closing"][:, 9].copy()


def _walked(velocity: F64) -> F64:
    """Return a velocity, shape (2,), no faster than anybody walks."""
    return np.asarray(velocity * min(1.0, FASTEST_M_S / max(float(np.hypot(*velocity)), 1e-9)))
