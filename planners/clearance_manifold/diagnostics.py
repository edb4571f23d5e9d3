"""What the clearance-manifold planner says of each tick."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planners.clearance_manifold.controller import Situation
from planners.clearance_manifold.lookout import Outlook
from planners.clearance_manifold.properties import Properties
from planners.clearance_manifold.tracker import Category, Continuation
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
    unseen_m_s: float = 0.0  # the walker who is reckoned with beyond what is seen; 0: nothing is open
    waits: bool = False  # an opening is not clear
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


def diagnose(
    told: Continuation, at: Situation, held: Properties, outlook: Outlook, speed: float, gain_per_s: float, utilisation: float
) -> ManifoldDiagnostics:
    """Return what is said of a tick with a manifold; `speed` is k_parallel, `gain_per_s` is k_perp, `utilisation` is M1."""
    return ManifoldDiagnostics(
        fallback_category=told.category.value,
        trigger=told.trigger,
        stopped="" if told.manifold.valid else "no passage is wide enough here",
        tracking=told.category is Category.NONE,
        utilisation=utilisation,
        deviation_m=told.deviation_m,
        reach_m=told.manifold.reach_m,
        free_m=min(at.free_m, at.clear_m),
        rho_ridge_m=at.ridge_clearance_m,
        margin_m=at.margin_m,
        commitment=at.commitment,
        speed_m_s=speed,
        error_m=float(np.hypot(*at.error)),
        bound_m=told.normal_speed_m_s / gain_per_s,
        unseen_m_s=outlook.demand_m_s,
        waits=outlook.waits,
        p1=held.p1_traversable,
        p2=held.p2_progress,
        p3=held.p3_branch,
        p4=held.p4_regular,
        p5=held.p5_reach,
        p6=held.p6_termination,
    )
