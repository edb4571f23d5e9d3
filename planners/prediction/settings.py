"""Settings of the conjecture family, and what each conjecture supposes."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from drivers.interface.settings import Settings

Name = Literal["static", "slow", "constant", "fast", "yielding", "aggressive"]
FAMILY: tuple[Name, ...] = ("static", "slow", "constant", "fast", "yielding", "aggressive")


class Conjecture(Settings):
    """One way in which an obstacle may go on from the velocity it is tracked with.

    Its velocity is v (speed_factor + slowing g) + pursuit g max(|v|, least_speed) towards the robot; g rises from 0 at the
    edge of the range of reaction to 1 at contact.
    """

    prior: float = Field(gt=0.0, le=1.0, description="q_0; those of the family are scaled to sum to one")
    speed_factor: float = Field(ge=0.0, le=5.0, description="of the tracked velocity")
    slowing: float = Field(
        default=0.0, ge=-1.0, le=5.0, description="added to the factor near the robot; negative: it slows down"
    )
    pursuit: float = Field(
        default=0.0, ge=-5.0, le=5.0, description="towards the robot, of its own speed; negative: it gives way"
    )
    least_speed_m_s: float = Field(default=0.0, ge=0.0, le=5.0, description="speed that pursuit counts with where it stands")
    acceleration_m_s2: float = Field(
        default=0.05, ge=0.0, le=20.0, description="standard deviation of what changes its velocity, each axis"
    )
    position_sigma_m: float = Field(default=0.03, gt=0.0, le=1.0, description="least noise of an observed position, each axis")
    velocity_sigma_m_s: float = Field(default=0.1, gt=0.0, le=5.0, description="least noise of an observed velocity, each axis")


def _conjecture(prior: float, speed_factor: float, **more: float) -> Conjecture:
    return Conjecture(prior=prior, speed_factor=speed_factor, **more)


class PredictionSettings(Settings):
    """The family Theta of section 4.1 and the stabilised posterior of appendix A."""

    family: tuple[Name, ...] = Field(default=FAMILY, min_length=1, description="conjectures in use")
    static: Conjecture = _conjecture(0.10, 0.0, acceleration_m_s2=0.02)
    slow: Conjecture = _conjecture(0.15, 0.5)
    constant: Conjecture = _conjecture(0.45, 1.0)
    fast: Conjecture = _conjecture(0.15, 1.5)
    yielding: Conjecture = _conjecture(0.10, 1.0, slowing=-0.8, pursuit=-0.3)
    aggressive: Conjecture = _conjecture(0.05, 1.0, slowing=0.25, pursuit=0.35, least_speed_m_s=0.2)
    update: bool = Field(default=True, description="false: the weights stay the prior (fixed-predictor RCSP)")
    per_obstacle: bool = Field(
        default=False, description="a posterior for each obstacle in place of one for all, as in the paper"
    )
    temperature: float = Field(default=2.0, gt=0.0, le=1000.0, description="tau: the likelihood is taken to the power 1 / tau")
    floor: float = Field(default=0.02, ge=0.0, lt=1.0, description="least weight of a conjecture")
    top_k: int = Field(default=4, ge=1, le=6, description="futures are drawn from so many of the heaviest conjectures")
    drift_m_s2: float = Field(
        default=0.5,
        ge=0.0,
        le=20.0,
        description="standard deviation of what changes a believed velocity, each axis: a track takes back its first guesses",
    )
    reaction_range_m: float = Field(default=2.0, gt=0.0, le=20.0, description="how far from contact an obstacle begins to react")
    sigma_cap_m: float = Field(
        default=1.0, gt=0.0, le=10.0, description="a position less certain than this is drawn as if it were so"
    )
    speed_sigma_cap_m_s: float = Field(default=2.0, gt=0.0, le=10.0, description="likewise a velocity")

    @model_validator(mode="after")
    def _no_name_twice(self) -> PredictionSettings:
        if len(set(self.family)) < len(self.family):
            raise ValueError("family names a conjecture twice")
        return self

    @model_validator(mode="after")
    def _floor_leaves_room(self) -> PredictionSettings:
        if self.floor * len(self.family) >= 1.0:
            raise ValueError(f"floor must be below 1 / {len(self.family)}, the number of conjectures")
        return self

    @property
    def models(self) -> tuple[Conjecture, ...]:
        """The conjectures in use, in the order of `family`."""
        return tuple(getattr(self, name) for name in self.family)
