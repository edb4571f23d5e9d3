"""How far the speeds that a base really runs at stray from those that its drives mean to run at."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from pydantic import Field

from drivers.interface.commands import BodyTwist
from drivers.interface.settings import Settings

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
        self._errors: list[float] = (
            settings.fraction * rng.standard_normal(3)
        ).tolist()  # of vx, vy, wz; stationary from the start
        self._draws: Iterator[list[float]] = iter(())  # plain numbers: three are too few for an array to be worth its while

    def spoil(self, twist: BodyTwist) -> BodyTwist:
        """Return the twist that is really run at for one period."""
        if self._quiet:
            return twist
        draw = next(self._draws, None)
        if draw is None:
            self._draws = iter((self._gain * self._rng.standard_normal((_BLOCK, 3))).tolist())
            draw = next(self._draws)
        self._errors = [self._retained * error + more for error, more in zip(self._errors, draw, strict=True)]
        vx, vy, wz = self._errors
        return BodyTwist((1.0 + vx) * twist.vx, (1.0 + vy) * twist.vy, (1.0 + wz) * twist.wz)
