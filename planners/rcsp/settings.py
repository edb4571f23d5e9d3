"""Settings of risk-sensitive conjectural scenario planning."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from drivers.interface.settings import Settings
from planners.prediction.settings import PredictionSettings
from planners.velocity_lattice import LatticeSettings


class RiskSettings(Settings):
    """What counts as risk, and which of its samples."""

    kind: Literal["inverse_clearance", "violation", "near_miss"] = Field(default="near_miss", description="g_risk")
    measure: Literal["cvar", "mean", "worst"] = Field(default="cvar", description="over the scenarios")
    tail_fraction: float = Field(default=0.1, gt=0.0, le=1.0, description="alpha")
    weight: float = Field(default=2.0, ge=0.0, le=1000.0, description="lambda")
    safe_m: float = Field(default=0.4, gt=0.0, le=5.0, description="clearance to what moves beyond which there is no risk")
    static_safe_m: float = Field(
        default=0.15, gt=0.0, le=5.0, description="likewise to what stands still; less where the route has less"
    )
    collision: float = Field(default=3.0, ge=0.0, le=100.0, description="added by near_miss where surfaces meet")
    depth_m: float = Field(default=0.3, gt=0.0, le=2.0, description="overlap beyond which risk does not grow")
    delta: float = Field(
        default=0.05, gt=0.0, lt=1.0, description="the bound of proposition C.3 holds with probability 1 - delta"
    )


class RewardSettings(Settings):
    """What counts as progress."""

    lateral: float = Field(default=0.5, ge=0.0, le=10.0, description="metres of route that a metre beside it costs")
    heading_m_per_rad: float = Field(default=0.15, ge=0.0, le=10.0, description="metres of route that facing away from it costs")
    look_ahead_m: float = Field(default=0.6, gt=0.0, le=10.0, description="how far along the route it should face")
    reverse: float = Field(default=0.4, ge=0.0, le=10.0, description="metres of route that a metre driven backwards costs")
    change: float = Field(
        default=0.05, ge=0.0, le=10.0, description="cost of a command as far from the last as standing from full speed"
    )


class BudgetSettings(Settings):
    """How many scenarios there are time for.  Costs are those of the machine that it runs on."""

    scenarios: int = Field(default=128, ge=1, le=4096, description="N, where the tick has time for them")
    scenarios_min: int = Field(default=8, ge=1, le=4096, description="with time for fewer it stands")
    fixed_us: float = Field(default=500.0, ge=0.0, le=1e6, description="of a decision, whatever the count")
    distance_ns: float = Field(
        default=0.16, gt=0.0, le=1000.0, description="of one distance of robot and obstacle, in one step of one scenario"
    )
    reacting_distance_ns: float = Field(
        default=1.6, gt=0.0, le=1000.0, description="of the same where obstacles react to each candidate"
    )
    share: float = Field(default=0.7, gt=0.0, le=1.0, description="of the time left that it may take")

    @model_validator(mode="after")
    def _ascends(self) -> BudgetSettings:
        if self.scenarios_min > self.scenarios:
            raise ValueError(f"scenarios_min must not exceed scenarios, which is {self.scenarios}")
        return self


class RcspSettings(Settings):
    """Everything that the planner can be set to; the paper's ablations are settings, too (README.md)."""

    predictor: Literal["conjectures", "constant_velocity", "random_walk"] = "conjectures"
    reaction: Literal["nominal", "candidate"] = Field(
        default="nominal", description="which motion of the robot the obstacles react to; nominal: that it goes on as it drives"
    )
    steps: int = Field(default=25, ge=2, le=200, description="H")
    step_s: float = Field(default=0.1, gt=0.0, le=1.0)
    rest_steps: int = Field(
        default=4,
        ge=0,
        le=50,
        description="after the horizon the robot brakes and stands; so long it is held against the futures",
    )
    rest_step_s: float = Field(default=0.6, gt=0.0, le=2.0, description="each of these steps")
    blocked: Literal["stand", "make_way"] = Field(
        default="make_way",
        description="what it does while the way is blocked: it stands, or stays there but makes way for who comes",
    )
    hold_m: float = Field(default=0.05, ge=0.0, le=1.0, description="a rollout brakes where what stands still is nearer")
    track_margin_m: float = Field(
        default=0.10, ge=0.0, le=1.0, description="occupied cells this near to a track's disc are its own"
    )
    stop_before_unknown: bool = Field(default=True, description="a rollout brakes before cells that were never seen")
    body_m: float = Field(default=0.35, ge=0.0, le=2.0, description="but not before those it stands on")
    diffusion_m_rt_s: float = Field(default=0.4, ge=0.0, le=10.0, description="of the random walk")
    fresh_draws: bool = Field(default=False, description="other random numbers at every tick; else the same for the whole run")
    arrival_m: float = Field(default=0.05, gt=0.0, le=1.0, description="this near the route's end it stands")
    lattice: LatticeSettings = LatticeSettings()
    prediction: PredictionSettings = PredictionSettings()
    risk: RiskSettings = RiskSettings()
    reward: RewardSettings = RewardSettings()
    budget: BudgetSettings = BudgetSettings()

    @model_validator(mode="after")
    def _somebody_reacts(self) -> RcspSettings:
        if self.reaction == "candidate" and self.predictor != "conjectures":
            raise ValueError(
                f"reaction 'candidate' needs the predictor 'conjectures', as obstacles of '{self.predictor}' never react"
            )
        return self
