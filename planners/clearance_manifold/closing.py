"""What closes in: how fast by all that was seen of it, and where it must be for a moment after it left the view.

Beyond the paper, whose field rate is zero outside of what is seen again and again.  A rate is smoothed and so late, and the
end of a wall that comes into view has one like somebody who steps out of it; but a wall stays where it is.  So the velocity
that slopes and rates give is weighed against how the boundary's middle really moves (Kalman filter, constant velocity).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.samples import frozen_array
from estimators.belief import F32, F64, ClearanceField, Mask
from planners.clearance_manifold.closing_kernels import SEEN_S, WIDTH, remember

SLOTS = 3  # so many are kept in mind


class ClosingMemory:
    """The boundaries that close in, or did last, each moved on with the velocity it has: `SLOTS` of however many."""

    def __init__(self, carry_s: float) -> None:
        """Take for how long one is carried on."""
        self._carry_s = carry_s
        self._slots: F64 = np.zeros((SLOTS, WIDTH))  # `closing_kernels` says what a slot holds

    def warm_up(self) -> None:
        """Compile the kernel, on a read-only field as a belief's is."""
        field, age_s = frozen_array(np.ones((3, 3), np.float32)), np.zeros((3, 3), np.float32)
        remember(np.zeros((SLOTS, WIDTH)), np.zeros((0, 5)), field, age_s, np.zeros(2), 1.0, 1.0, 0.0)

    @property
    def begins(self) -> Mask:
        """Whether what is in a slot is another than at the time before, shape (SLOTS,)."""
        return np.asarray(self._slots[:, SEEN_S] == 0.0)

    def update(self, found: F64, field: ClearanceField, age_s: F32, elapsed_s: float) -> F64:
        """Return what closes in, slot by slot: what is seen to, or where what was seen to must be by now; shape (SLOTS, 5).

        Args:
            found: what is seen to, the nearest first, shape (n, 5), n <= SLOTS.
            field: the clearance now.
            age_s: since each of its cells was looked at, shape (rows, columns).
            elapsed_s: since the last time.
        """
        corner = np.array([field.lattice.x_m, field.lattice.y_m])
        return remember(self._slots, found, field.clearance_m, age_s, corner, field.lattice.cell_m, self._carry_s, elapsed_s)

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is carried on, as named arrays."""
        return {"closing": self._slots.copy()}

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._slots = state["closing"].copy()


def nearest_of(come: F64, point: F64) -> F64:
    """Return where the nearest to a point, shape (2,), is of those who come, shape (n, 5), n > 0: shape (2,)."""
    return np.asarray(come[np.argmin(np.hypot(come[:, 0] - point[0], come[:, 1] - point[1])), :2])
