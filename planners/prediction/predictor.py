"""The contract of a predictor: from what was seen of the obstacles to samples of where each will be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from drivers.interface.stateful import Stateful
from estimators.belief import F32, F64, Belief
from planners.prediction.chance import Chance
from planners.prediction.observed import Observed


@dataclass(frozen=True, slots=True)
class Futures:
    """Sampled futures of all obstacles; a scenario is one future of all of them together."""

    position_in_odom: F32  # (steps, obstacles, 2, scenarios), contiguous: kernels run along the scenarios
    radius_m: F64  # (obstacles,)
    conjecture: NDArray[np.int64]  # (obstacles, scenarios), which of `Predictor.conjectures` each was made under

    @property
    def scenarios(self) -> int:
        """How many there are."""
        return int(self.position_in_odom.shape[3])


@dataclass(frozen=True, slots=True)
class Occasion:
    """What futures are asked for: when, beside which motion of the robot, and how many."""

    times_s: F64  # (steps,), after the belief, increasing
    robot_in_odom: F64  # (steps, 2), where the robot is meant to be at those times; some predictions react to it
    scenarios: int


@runtime_checkable
class Predictor(Stateful, Protocol):
    """Predicts.  `observe` is called with every belief, `sample` as often as wanted in between.

    Nothing in it depends on how it predicts: a filter per obstacle, a network with its own history (kept by `observe`, given
    out by `snapshot`) and a Gaussian process stand behind it alike.
    """

    conjectures: tuple[str, ...]  # what it holds possible, by name; one that holds one thing has one

    def warm_up(self) -> None:
        """Compile every kernel."""
        ...

    def observe(self, belief: Belief) -> None:
        """Take in the tracks of a belief; those that are gone are forgotten, those that are not finite left out."""
        ...

    @property
    def seen(self) -> Observed:
        """The tracks last observed."""
        ...

    @property
    def weights(self) -> F64:
        """How much each conjecture is believed in, shape (conjectures,), summing to one; a mean over the obstacles."""
        ...

    def sample(self, occasion: Occasion, chance: Chance) -> Futures:
        """Return futures of the tracks last observed, drawn from `chance` alone."""
        ...
