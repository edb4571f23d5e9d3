"""What predictors share that look at nothing but the tracks as they are now."""

from __future__ import annotations

import numpy as np

from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, Belief
from planners.prediction.observed import Observed, nobody, observed


class Memoryless:
    """Holds the tracks last observed, and one conjecture."""

    def __init__(self) -> None:
        """Start with nobody there."""
        self._seen: Observed = nobody()

    def warm_up(self) -> None:
        """There is nothing to compile."""

    def observe(self, belief: Belief) -> None:
        """Take in the tracks."""
        self._seen = observed(belief.tracks)

    @property
    def seen(self) -> Observed:
        """The tracks last observed."""
        return self._seen

    @property
    def weights(self) -> F64:
        """One."""
        return np.ones(1)

    def snapshot(self) -> bytes:
        """Return the tracks last observed."""
        seen = self._seen
        return pack(identity=seen.identity, state=seen.state, spread=seen.spread, radius_m=seen.radius_m, left_out=seen.left_out)

    def restore(self, snapshot: bytes) -> None:
        """Take them over."""
        s = unpack(snapshot)
        self._seen = Observed(s["identity"], s["state"], s["spread"], s["radius_m"], int(s["left_out"]))
