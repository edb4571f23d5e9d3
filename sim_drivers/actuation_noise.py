"""How far the speeds that a base really runs at stray from those that its drives mean to run at."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.settings import Settings

F64 = NDArray[np.float64]

_BLOCK = 256  # draws at a time


class ActuationNoiseSettings(Settings):
    """Multiplicative noise that lasts for a while, as from a supply, a gear or a floor that is not even.

    The default is none: what a wheel's radius, slip and servo do to a speed is in the chassis already.  The paper that asks for
    actuation noise (Han, Zhu, RCSP, section 5.1) does not say how much.
    """

    fraction: float = Field(default=0.0, ge=0.0, le=0.5, description="standard deviation of a speed, relative to that speed")
    time_s: float = Field(default=0.2, gt=0.0, le=10.0, description="time constant with which it is forgotten")


class ActuationNoise:
    """A first-order Gauss-Markov process for each axis, by which the twist is scaled."""

    def __init__(self, settings: ActuationNoiseSettings, rng: np.random.Generator, period_s: float) -> None:
        """Draw from `rng` in the order of the calls, which come every `period_s`."""
        self._rng = rng
        self._retained = math.exp(-period_s / settings.time_s)
        self._gain = settings.fraction * math.sqrt(1.0 - self._retained**2)
        self._quiet = settings.fraction == 0.0
        self._errors: F64 = settings.fraction * rng.standard_normal(3)  # of vx, vy, wz; stationary from the start
        self._draws: F64 = np.zeros((0, 3))
        self._row = 0  # of the draw that comes next

    def spoil(self, twist: F64) -> F64:
        """Return the twist that is really run at for one period instead of vx, vy, wz, shape (3,)."""
        if self._quiet:
            return twist
        if self._row == len(self._draws):
            self._draws, self._row = self._gain * self._rng.standard_normal((_BLOCK, 3)), 0
        self._errors = self._retained * self._errors + self._draws[self._row]
        self._row += 1
        return (1.0 + self._errors) * twist
