"""Everybody goes on as tracked: straight on, with the doubt that the track itself has."""

from __future__ import annotations

import numpy as np

from planners.prediction.chance import Chance
from planners.prediction.memoryless import Memoryless
from planners.prediction.predictor import Futures, Occasion


class ConstantVelocityPredictor(Memoryless):
    """Draws a state from each track's covariance and lets it go straight on."""

    conjectures: tuple[str, ...] = ("constant",)

    def sample(self, occasion: Occasion, chance: Chance) -> Futures:
        """Return straight lines."""
        seen, count = self._seen, occasion.scenarios
        normal = chance.normal("start", len(seen), 4, count).reshape(-1, 2, 2, count).transpose(1, 0, 2, 3)
        sigma = np.sqrt(seen.spread[:, 0])
        gain = np.divide(seen.spread[:, 1], sigma, out=np.zeros(len(seen)), where=sigma > 0.0)
        rest = np.sqrt(np.maximum(seen.spread[:, 2] - gain * gain, 0.0))
        start = seen.state[:, :2, None] + sigma[:, None, None] * normal[0]
        velocity = seen.state[:, 2:, None] + gain[:, None, None] * normal[0] + rest[:, None, None] * normal[1]
        position = start + occasion.times_s[:, None, None, None] * velocity
        return Futures(position.astype(np.float32, order="C"), seen.radius_m, np.zeros((len(seen), count), np.int64))
