"""Nobody knows: everybody wanders from where he is, at a speed that says nothing of where to."""

from __future__ import annotations

import numpy as np

from planners.prediction.chance import Chance
from planners.prediction.memoryless import Memoryless
from planners.prediction.predictor import Futures, Occasion


class RandomWalkPredictor(Memoryless):
    """A Brownian motion from each track's place; its spread grows with the root of the time."""

    conjectures: tuple[str, ...] = ("random_walk",)

    def __init__(self, diffusion_m_rt_s: float) -> None:
        """Take the standard deviation after one second, each axis."""
        super().__init__()
        self._diffusion = diffusion_m_rt_s

    def sample(self, occasion: Occasion, chance: Chance) -> Futures:
        """Return walks."""
        seen, count, steps_s = self._seen, occasion.scenarios, np.diff(occasion.times_s, prepend=0.0)
        start = chance.normal("start", len(seen), 2, count) * np.sqrt(seen.spread[:, :1, None]) + seen.state[:, :2, None]
        normal = chance.normal("stride", len(seen), 2 * len(steps_s), count).reshape(-1, len(steps_s), 2, count)
        stride = normal.transpose(1, 0, 2, 3) * (self._diffusion * np.sqrt(steps_s)[:, None, None, None])
        return Futures(
            (start + np.cumsum(stride, axis=0)).astype(np.float32, order="C"),
            seen.radius_m,
            np.zeros((len(seen), count), np.int64),
        )
