"""What closes in, kept for a moment after it left the view: it does not stop because the camera turned away.

Beyond the paper, whose field rate is zero outside of what is seen again and again.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.belief import F32, F64, ClearanceField
from estimators.field_query import sample

FREE_AROUND_M = 0.45  # a place in view with so much clearance is nobody's
SURE_S = 0.3  # what was seen to close in for less is the noise of a rate
SLOW_M_S = 0.45  # the rates of a wall seen while turning look like this; nobody so slow is dangerous out of view
SAME_M = 0.5  # from one time to the next, what is nearer than this to where it must be is the same


class ClosingMemory:
    """The boundary that closed in last, moved on with the velocity it had."""

    def __init__(self, carry_s: float) -> None:
        """Take for how long it is carried on."""
        self._carry_s = carry_s
        self._kept: F64 = np.zeros(5)  # as `nearest_closing` gives it
        self._seen_s, self._unseen_s = 0.0, 0.0

    def update(self, found: F64, field: ClearanceField, age_s: F32, elapsed_s: float) -> F64:
        """Return what closes in: what is seen to, or where what was seen to must be by now; shape (5,).

        Args:
            found: what is seen to, shape (5,); its last element is 0 where nothing does.
            field: the clearance now.
            age_s: since each of its cells was in view, shape (rows, columns).
            elapsed_s: since the last time.
        """
        self._kept[:2] += elapsed_s * self._kept[2:4]
        if found[4] > 0.0:
            same = self._kept[4] > 0.0 and np.hypot(*(found[:2] - self._kept[:2])) < SAME_M
            self._seen_s = self._seen_s + elapsed_s if same else 0.0
            self._kept, self._unseen_s = found.copy(), 0.0
            return found
        self._unseen_s += elapsed_s
        there = self._kept[None, :2]
        seen = float(sample(age_s, field.lattice, there)[0]) == 0.0
        free = float(sample(field.clearance_m, field.lattice, there)[0]) > FREE_AROUND_M
        slow = float(np.hypot(*self._kept[2:4])) < SLOW_M_S
        if slow or self._seen_s < SURE_S or self._unseen_s > self._carry_s or (seen and free):
            self._kept, self._seen_s = np.zeros(5), 0.0
        return self._kept.copy()

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is carried on, as named arrays."""
        return {"closing": np.append(self._kept, (self._seen_s, self._unseen_s))}

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._kept = state["closing"][:5].copy()
        self._seen_s, self._unseen_s = state["closing"][5:].tolist()
