"""The conjecture family: a state belief under each conjecture, a posterior over them, and futures of the mixture.

Source: Han, Zhu, RCSP, sections 4.1 and 4.2, appendices A and B.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, Belief
from planners.prediction.chance import Chance
from planners.prediction.kernels import HOLD, Draws, drawn_starts, followed, places_of, propagate
from planners.prediction.observed import Observed, nobody, observed
from planners.prediction.posterior import floored, heaviest, updated
from planners.prediction.predictor import Futures, Occasion
from planners.prediction.settings import PredictionSettings

SECOND_NS = 1_000_000_000
LONGEST_STEP_S = 1.0  # a belief later than this after the one before is no evidence for anything


class ConjectureFamily:
    """Draws futures of obstacles from a mixture of conjectures whose weights follow what they predicted."""

    def __init__(self, settings: PredictionSettings, robot_radius_m: float) -> None:
        """Begin with the prior, and nobody there."""
        self._settings, self._robot_radius_m = settings, robot_radius_m
        self.conjectures: tuple[str, ...] = settings.family
        models = settings.models
        prior = np.array([model.prior for model in models])
        self._prior = floored(prior / prior.sum(), settings.floor) if settings.update else prior / prior.sum()
        self._coefficients = np.array(
            [
                (m.speed_factor, m.slowing, m.pursuit, m.least_speed_m_s, m.acceleration_m_s2, m.position_sigma_m,
                 m.velocity_sigma_m_s)
                for m in models
            ]
        )  # fmt: skip
        self._believed = self._coefficients.copy()  # with the noise that beliefs are carried on with
        self._believed[:, 4] = np.maximum(self._believed[:, 4], settings.drift_m_s2)
        self._cap = np.array([settings.sigma_cap_m, settings.speed_sigma_cap_m_s])
        self.reset()

    def reset(self) -> None:
        """Forget everybody."""
        count = len(self.conjectures)
        self._seen: Observed = nobody()
        self._mean, self._spread = np.zeros((count, 0, 4)), np.zeros((count, 0, 3))
        self._posterior = np.zeros((0, count))  # (obstacles, conjectures), where each has one of its own
        self._shared: F64 = self._prior
        self._stamp_ns = 0

    @property
    def weights(self) -> F64:
        """The posterior, shape (conjectures,)."""
        if self._settings.per_obstacle and len(self._posterior):
            return np.asarray(self._posterior.mean(axis=0))
        return self._shared

    @property
    def seen(self) -> Observed:
        """The tracks last observed."""
        return self._seen

    def warm_up(self) -> None:
        """Compile the kernels, on somebody who is followed."""
        one, lattice = type(self)(self._settings, self._robot_radius_m), np.zeros(2)
        one._follow(Observed(np.zeros(1, np.int64), np.ones((1, 4)), np.ones((1, 3)), np.ones(1)), lattice, 0.0)
        one._follow(one._seen, lattice, 0.1)
        one.sample(Occasion(np.array([0.1, 0.2]), np.zeros((2, 2)), 2), Chance(0, "rehearsal"))

    def observe(self, belief: Belief) -> None:
        """Take in the tracks: beliefs under each conjecture are carried on and corrected, the posterior follows."""
        elapsed_s = (belief.stamp_ns - self._stamp_ns) / SECOND_NS
        robot = np.array([belief.odom_from_base.x, belief.odom_from_base.y])
        self._follow(observed(belief.tracks), robot, elapsed_s if elapsed_s <= LONGEST_STEP_S else 0.0)
        self._stamp_ns = belief.stamp_ns

    def _follow(self, now: Observed, robot: F64, elapsed_s: float) -> None:
        """Take in the tracks; without a time since those before, everybody is new."""
        before = self._seen.identity if elapsed_s > 0.0 else self._seen.identity[:0]
        places = places_of(now.identity, before)
        self._mean, self._spread, likelihood = followed(
            self._mean, self._spread, places, self._believed, now.state, now.spread, now.radius_m + self._robot_radius_m,
            robot, self._settings.reaction_range_m, elapsed_s,
        )  # fmt: skip
        self._seen = now
        self._weigh(places, likelihood)

    def _weigh(self, places: NDArray[np.int64], log_likelihood: F64) -> None:
        """Update the weights by the log-likelihoods, shape (conjectures, obstacles)."""
        s = self._settings
        if s.per_obstacle:
            self._posterior = np.where(places[:, None] < 0, self._prior, self._posterior[places] if len(self._posterior) else 0.0)
        if (places < 0).all():  # nobody whom it knows: what the others did says nothing
            self._shared = self._prior
        if not s.update:
            return
        if s.per_obstacle:
            self._posterior = updated(self._posterior, np.ascontiguousarray(log_likelihood.T), s.temperature, s.floor)
        else:
            self._shared = updated(self._shared[None], log_likelihood.sum(axis=1)[None], s.temperature, s.floor)[0]

    def draw(self, steps: int, scenarios: int, chance: Chance) -> tuple[Draws, NDArray[np.int64]]:
        """Return where the scenarios start and what drives them on, and the conjecture of each, shape (obstacles, scenarios)."""
        s, obstacles = self._settings, len(self._seen)
        edges = np.cumsum(heaviest(self._posterior if s.per_obstacle else self._shared[None], s.top_k), axis=1)
        uniform = chance.uniform("conjecture", len(edges), scenarios)
        normal = chance.normal("start", obstacles, 4, scenarios)
        push = chance.normal("push", obstacles, 2 * -(-steps // HOLD), scenarios)
        told: tuple[Draws, NDArray[np.int64]] = drawn_starts(
            self._mean, self._spread, self._coefficients, edges, uniform, normal, push,
            self._seen.radius_m + self._robot_radius_m, self._cap, s.reaction_range_m,
        )  # fmt: skip
        return told

    def sample(self, occasion: Occasion, chance: Chance) -> Futures:
        """Return futures beside one motion of the robot."""
        return self.sample_with_draws(occasion, chance)[0]

    def sample_with_draws(self, occasion: Occasion, chance: Chance) -> tuple[Futures, Draws]:
        """Return the futures and what they were made from, for futures beside other motions of the robot."""
        steps_s = occasion.times_s.copy()
        steps_s[1:] -= occasion.times_s[:-1]
        draws, which = self.draw(len(steps_s), occasion.scenarios, chance)
        position = propagate(draws, steps_s, occasion.robot_in_odom.astype(np.float32))
        return Futures(position, self._seen.radius_m, which), draws

    def snapshot(self) -> bytes:
        """Return the whole state."""
        seen = self._seen
        return pack(
            identity=seen.identity, state=seen.state, observed_spread=seen.spread, radius_m=seen.radius_m, left_out=seen.left_out,
            mean=self._mean, spread=self._spread, posterior=self._posterior, shared=self._shared, stamp_ns=self._stamp_ns,
        )  # fmt: skip

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        s = unpack(snapshot)
        self._seen = Observed(s["identity"], s["state"], s["observed_spread"], s["radius_m"], int(s["left_out"]))
        self._mean, self._spread, self._posterior, self._shared = (s[n] for n in ("mean", "spread", "posterior", "shared"))
        self._stamp_ns = int(s["stamp_ns"])
