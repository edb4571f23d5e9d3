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

from estimators.belief import F32, F64, ClearanceField
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
SAME_M = 0.5  # from one time to the next, what is nearer than this to where it must be is the same


class ClosingMemory:
    """The boundary that closes in, or did last, moved on with the velocity it has."""

    def __init__(self, carry_s: float) -> None:
        """Take for how long it is carried on."""
        self._carry_s = carry_s
        self._kept: F64 = np.zeros(5)  # as `nearest_closing` gives it
        self._spread: F64 = np.zeros(3)  # variance of its place, covariance with its velocity, and that one's variance
        self._seen_s, self._unseen_s = 0.0, 0.0

    @property
    def begins(self) -> bool:
        """Whether what closes in is another than at the time before."""
        return self._seen_s == 0.0

    def update(self, found: F64, field: ClearanceField, age_s: F32, elapsed_s: float) -> F64:
        """Return what closes in: what is seen to, or where what was seen to must be by now; shape (5,).

        Args:
            found: what is seen to, shape (5,); its last element is 0 where nothing does.
            field: the clearance now.
            age_s: since each of its cells was looked at, shape (rows, columns).
            elapsed_s: since the last time.
        """
        self._kept[:2] += elapsed_s * self._kept[2:4]
        if found[4] > 0.0:
            found = np.concatenate((found[:2], _walked(found[2:4]), found[4:]))
            same = self._kept[4] > 0.0 and np.hypot(*(found[:2] - self._kept[:2])) < SAME_M
            if same:
                self._weigh(found, elapsed_s)
            else:
                self._kept, self._spread = found.copy(), np.array([MIDDLE_M**2, 0.0, FIRST * RATE_M_S**2])
                self._kept[2:4] *= FIRST
            self._seen_s = self._seen_s + elapsed_s if same else 0.0
            self._unseen_s = 0.0
            return self._kept.copy() if np.hypot(*self._kept[2:4]) > STILL_M_S else np.zeros(5)
        self._unseen_s += elapsed_s
        there = self._kept[None, :2]
        seen = float(sample(age_s, field.lattice, there)[0]) == 0.0
        free = float(sample(field.clearance_m, field.lattice, there)[0]) > FREE_AROUND_M
        unsure = self._seen_s < SURE_S or float(np.hypot(*self._kept[2:4])) < SURE * math.sqrt(self._spread[2])
        if unsure or self._unseen_s > self._carry_s or (seen and free):
            self._kept, self._seen_s = np.zeros(5), 0.0
        return self._kept.copy()

    def _weigh(self, found: F64, elapsed_s: float) -> None:
        """Correct position and velocity, which the same gains hold for in x and y, by what is seen now."""
        if elapsed_s <= 0.0:
            return
        place, both, speed = self._spread  # variances of position and velocity, and their covariance between them
        drift = SWERVE_M_S**2 * elapsed_s
        place, both, speed = place + elapsed_s * (2.0 * both + elapsed_s * speed), both + elapsed_s * speed, speed + drift
        for index, noise in ((0, MIDDLE_M**2), (2, RATE_M_S**2 * max(1.0, RATE_S / elapsed_s))):
            column = np.array([place, both]) if index == 0 else np.array([both, speed])
            gain = column / ((place if index == 0 else speed) + noise)
            off = found[index : index + 2] - self._kept[index : index + 2]
            self._kept[:2] += gain[0] * off
            self._kept[2:4] += gain[1] * off
            taken = gain[:, None] * column
            place, both, speed = place - taken[0, 0], both - taken[0, 1], speed - taken[1, 1]
        self._kept[4], self._spread = found[4], np.array([place, both, speed])

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is carried on, as named arrays."""
        return {"closing": np.concatenate((self._kept, self._spread, (self._seen_s, self._unseen_s)))}

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._kept = state["closing"][:5].copy()
        self._spread = state["closing"][5:8].copy()
        self._seen_s, self._unseen_s = state["closing"][8:].tolist()


def _walked(velocity: F64) -> F64:
    """Return a velocity, shape (2,), no faster than anybody walks."""
    return np.asarray(velocity * min(1.0, FASTEST_M_S / max(float(np.hypot(*velocity)), 1e-9)))
