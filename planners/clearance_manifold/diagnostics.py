"""What the clearance-manifold planner says of each tick."""

from __future__ import annotations

from dataclasses import dataclass

from planners.planner import Diagnostics


@dataclass(frozen=True, slots=True)
class ManifoldDiagnostics(Diagnostics):
    """The outcome of a tick."""

    fallback_category: str = "none"  # M3; empty: nothing was planned
    trigger: str = ""
    stopped: str = ""  # why it asks to stand
    tracking: bool = False
    utilisation: float = 0.0  # M1, share of the run's ticks so far that continued
    deviation_m: float = 0.0  # M2
    reach_m: float = 0.0
    free_m: float = 0.0
    rho_ridge_m: float = 0.0
    margin_m: float = 0.0
    commitment: float = 0.0  # a_pred
    speed_m_s: float = 0.0  # k_parallel
    error_m: float = 0.0  # |e_perp|
    bound_m: float = 0.0  # v_gamma / k_perp
    p1: bool = False
    p2: bool = False
    p3: bool = False
    p4: bool = False
    p5: bool = False
    p6: bool = True

    @property
    def refused(self) -> bool:
        """Whether there was nothing to follow, so that no manifold was asked for."""
        return not self.fallback_category
