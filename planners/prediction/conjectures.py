"""The conjecture family: a state belief under each conjecture, a posterior over them, and futures of the mixture.

Source: Han, Zhu, RCSP, sections 4.1 and 4.2, appendices A and B.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, Belief
from planners.prediction.kernels import HOLD, Draws, assimilate, propagate, spread_draws
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
        self._cap = np.array([settings.sigma_cap_m, settings.speed_sigma_cap_m_s])
        self.reset()

    def reset(self) -> None:
        """Forget everybody."""
        count = len(self.conjectures)
        self._seen: Observed = nobody()
        self._mean, self._spread = np.zeros((count, 0, 4)), np.zeros((count, 0, 3))
        self._posterior = np.zeros((0, count))  # (obstacles, conjectures); with one for all its rows are the same
        self._shared = self._prior
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
        """Compile the kernels."""
        one = type(self)(self._settings, self._robot_radius_m)
        one._seen = Observed(np.zeros(1, np.int64), np.zeros((1, 4)), np.ones((1, 3)), np.ones(1))
        one._mean, one._spread = (np.ones((len(self.conjectures), 1, width)) for width in (4, 3))
        one._posterior = self._prior[None]
        one._assimilated(one._mean, one._spread, one._seen, np.zeros(2), 0.1)
        one.sample(Occasion(np.array([0.1, 0.2]), np.zeros((2, 2)), 2), np.random.Generator(np.random.PCG64(0)))

    def observe(self, belief: Belief) -> None:
        """Take in the tracks: beliefs under each conjecture are carried on and corrected, the posterior follows."""
        now, elapsed_s = observed(belief.tracks), (belief.stamp_ns - self._stamp_ns) / SECOND_NS
        known, before = _matches(now.identity, self._seen.identity)
        if not 0.0 < elapsed_s <= LONGEST_STEP_S:
            known, before = known[:0], before[:0]
        mean, spread = np.tile(now.state, (len(self.conjectures), 1, 1)), np.tile(now.spread, (len(self.conjectures), 1, 1))
        posterior = np.tile(self._prior, (len(now), 1))
        if len(known):
            mean[:, known], spread[:, known] = self._mean[:, before], self._spread[:, before]
            posterior[known] = self._posterior[before]
            robot = np.array([belief.odom_from_base.x, belief.odom_from_base.y])
            likelihood = self._assimilated(mean, spread, now, robot, elapsed_s)[:, known]
            fresh = np.setdiff1d(np.arange(len(now)), known)
            mean[:, fresh], spread[:, fresh] = now.state[fresh], now.spread[fresh]
            self._weigh(posterior, known, likelihood.T)
        self._seen, self._mean, self._spread, self._posterior, self._stamp_ns = now, mean, spread, posterior, belief.stamp_ns

    def _weigh(self, posterior: F64, known: NDArray[np.intp], log_likelihood: F64) -> None:
        """Update the weights by the log-likelihoods, shape (known, conjectures)."""
        s = self._settings
        if not s.update:
            return
        posterior[known] = updated(posterior[known], log_likelihood, s.temperature, s.floor)
        self._shared = updated(self._shared, log_likelihood.sum(axis=0), s.temperature, s.floor)

    def _assimilated(self, mean: F64, spread: F64, now: Observed, robot: F64, elapsed_s: float) -> F64:
        contact = now.radius_m + self._robot_radius_m
        likelihood: F64 = assimilate(
            mean, spread, self._coefficients, now.state, now.spread, contact, robot, self._settings.reaction_range_m, elapsed_s
        )
        return likelihood

    def draw(self, steps: int, scenarios: int, rng: np.random.Generator) -> tuple[Draws, NDArray[np.int64]]:
        """Return where the scenarios start and what drives them on, and the conjecture of each, shape (obstacles, scenarios)."""
        which = self._drawn_conjectures(scenarios, rng)
        obstacles, holds = len(self._seen), -(-steps // HOLD)
        normal = rng.standard_normal((4, obstacles, scenarios), dtype=np.float32)
        push = rng.standard_normal((holds, obstacles, 2, scenarios), dtype=np.float32)
        of = self._coefficients.astype(np.float32)[:, :5].T[:, which]  # (5, obstacles, scenarios)
        push *= of[4][None, :, None]
        position, velocity = (np.empty((obstacles, 2, scenarios), np.float32) for _ in range(2))
        spread_draws(self._mean, self._spread, which, normal, self._cap, position, velocity)
        contact = (self._seen.radius_m + self._robot_radius_m).astype(np.float32)
        factor, slowing, pursuit, least = (np.ascontiguousarray(of[c]) for c in range(4))
        range_m = self._settings.reaction_range_m
        return Draws(position, velocity, push, factor, slowing, pursuit, least, contact, range_m), which

    def sample(self, occasion: Occasion, rng: np.random.Generator) -> Futures:
        """Return futures beside one motion of the robot."""
        return self.sample_with_draws(occasion, rng)[0]

    def sample_with_draws(self, occasion: Occasion, rng: np.random.Generator) -> tuple[Futures, Draws]:
        """Return the futures and what they were made from, for futures beside other motions of the robot."""
        steps_s = np.diff(occasion.times_s, prepend=0.0)
        draws, which = self.draw(len(steps_s), occasion.scenarios, rng)
        position = propagate(draws, steps_s, occasion.robot_in_odom.astype(np.float32))
        return Futures(position, self._seen.radius_m, which), draws

    def _drawn_conjectures(self, scenarios: int, rng: np.random.Generator) -> NDArray[np.int64]:
        """Draw theta of every scenario from the heaviest conjectures; with one posterior for all, all obstacles share it."""
        s, obstacles = self._settings, len(self._seen)
        weights = heaviest(self._posterior if s.per_obstacle else self._shared[None], s.top_k)
        uniform = rng.random((len(weights), scenarios))
        edges = np.cumsum(weights, axis=1)
        edges[:, -1] = 1.0
        which = (uniform[:, None, :] >= edges[:, :-1, None]).sum(axis=1)
        return np.ascontiguousarray(np.broadcast_to(which, (obstacles, scenarios)), dtype=np.int64)

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


def _matches(now: NDArray[np.int64], before: NDArray[np.int64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the places in `now` and in `before` of the identities that both hold."""
    _, here, there = np.intersect1d(now, before, return_indices=True)
    return here, there
