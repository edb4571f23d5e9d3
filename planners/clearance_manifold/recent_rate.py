"""How the clearance changed of late, without a memory: what the smoothed rate says late and in halves.

Beyond the paper.  Its rate is smoothed over more than half a second, which is right where a rate marks what closes in; but who
walks has gone on by then, and where he sets foot the rate has only begun to follow.  His velocity is fitted to this one.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.belief import F32, ClearanceField, Lattice
from estimators.memory.rolling import transfer

WINDOW_S = 0.2  # the paper's period: at least so long ago, at most twice
SECOND_NS = 1_000_000_000


class RecentRate:
    """The difference to a field of at least `WINDOW_S` ago."""

    def __init__(self) -> None:
        """Start without a field before."""
        self._lattice: Lattice | None = None  # of both
        self._then: tuple[F32, int] = (np.zeros((0, 0), np.float32), 0)  # (rows, columns), NaN where unknown, and its stamp
        self._next: tuple[F32, int] = self._then  # what follows it

    def update(self, field: ClearanceField, stamp_ns: int) -> F32:
        """Take in a field; return its rate [m/s], shape (rows, columns), NaN where nothing is known of it."""
        now = np.where(field.known, field.clearance_m, np.float32(np.nan))
        if self._lattice is None or self._lattice.cell_m != field.lattice.cell_m:
            self._then = self._next = (now, stamp_ns)
        elif self._lattice != field.lattice:
            self._then, self._next = (
                (transfer(kept, self._lattice, field.lattice, np.nan), at) for kept, at in (self._then, self._next)
            )
        self._lattice = field.lattice
        if stamp_ns - self._next[1] >= round(WINDOW_S * SECOND_NS):
            self._then, self._next = self._next, (now, stamp_ns)
        kept, at_ns = self._then
        elapsed_s = (stamp_ns - at_ns) / SECOND_NS
        return np.asarray((now - kept) * np.float32(1.0 / elapsed_s if elapsed_s > 0.0 else np.nan))

    def window_s(self, stamp_ns: int) -> float:
        """Return over which time before that stamp the rate is taken [s]."""
        return (stamp_ns - self._then[1]) / SECOND_NS

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is carried on, as named arrays."""
        at = self._lattice
        return {
            "recent_corner": np.zeros(0) if at is None else np.array([at.x_m, at.y_m, at.cell_m]),
            "recent_then": self._then[0],
            "recent_next": self._next[0],
            "recent_stamps_ns": np.array([self._then[1], self._next[1]], np.int64),
        }

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        corner = state["recent_corner"].tolist()
        then, after = (np.asarray(state[name], np.float32) for name in ("recent_then", "recent_next"))
        self._lattice = Lattice(*corner, *then.shape) if corner else None
        stamps = state["recent_stamps_ns"].tolist()
        self._then, self._next = (then, int(stamps[0])), (after, int(stamps[1]))
