"""Settings of the lattice filter."""

from __future__ import annotations

from pydantic import Field

from drivers.interface.settings import Settings
from planners.velocity_lattice import LatticeSettings


class FilterLatticeSettings(LatticeSettings):
    """Candidates: backwards it goes slowly, unless it is asked to go faster."""

    reverse_m_s: float = Field(default=0.3, ge=0.0, le=5.0, description="fastest backwards, where the base may reverse at all")


class LatticeShieldSettings(Settings):
    """Section 4.4; the paper gives no numbers."""

    horizon_s: float = Field(default=1.2, gt=0.0, le=10.0, description="of the rollout")
    steps: int = Field(default=12, ge=2, le=100)
    hard_m: float = Field(default=0.05, ge=0.0, le=1.0, description="c_hard")
    gain: float = Field(default=0.9, gt=0.0, le=1.0, description="kappa: share of the margin that a rollout may take")
    far_m: float = Field(default=1.0, gt=0.0, le=10.0, description="clearance beyond which more is worth nothing")
    track_margin_m: float = Field(default=0.10, ge=0.0, le=1.0, description="occupied cells this near to a track are its own")
    weight_progress: float = Field(default=0.5, ge=0.0, le=100.0, description="per metre towards where the asked twist leads")
    weight_clearance: float = Field(default=0.5, ge=0.0, le=100.0, description="per metre")
    weight_closeness: float = Field(default=1.5, ge=0.0, le=100.0, description="per share of the caps between the two")
    weight_violation: float = Field(default=30.0, ge=0.0, le=1000.0, description="per metre that a candidate is infeasible by")
    after_s: float = Field(default=1.2, gt=0.0, le=10.0, description="going on, or a stop, has to keep clear for so long then")
    after_steps: int = Field(default=6, ge=1, le=100)
    patience_s: float = Field(default=4.0, ge=0.0, le=60.0, description="who came and stands may set off again for so long")
    steady_s: float = Field(
        default=0.5,
        ge=0.0,
        le=5.0,
        description="time constant that his velocity is smoothed with: who is seen from another side jumps for a look or two",
    )
    lattice: FilterLatticeSettings = FilterLatticeSettings()
