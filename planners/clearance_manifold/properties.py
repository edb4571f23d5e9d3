"""Properties P1 to P6 of a manifold, checked after the fact (section 4.2)."""

from __future__ import annotations

from dataclasses import dataclass

from planners.clearance_manifold.tracker import Continuation


@dataclass(frozen=True, slots=True)
class Properties:
    """Whether each holds at this tick."""

    p1_traversable: bool  # clearance at least rho_min on all of it
    p2_progress: bool  # it ends nearer to the goal than it begins
    p3_branch: bool  # the same branch as in the frame before
    p4_regular: bool  # no station moved farther than L times 0.2 s in the last 0.2 s
    p5_reach: bool  # it reaches farther than the tracking error can be
    p6_termination: bool  # or else the robot is told to stop within what holds

    @property
    def contract(self) -> bool:
        """P1 to P5, or P6 in their place."""
        return self.p6_termination


def check(
    told: Continuation, *, least_m: float, lipschitz_m_s: float, lateral_gain_per_s: float, error_m: float, stops: bool
) -> Properties:
    """Return what holds.

    Args:
        told: the manifold and how it came about.
        least_m: rho_min.
        lipschitz_m_s: L.
        lateral_gain_per_s: k_perp.
        error_m: transverse error of the robot.
        stops: whether the command can be braked before the manifold ends.
    """
    manifold = told.manifold
    ahead = manifold.ahead
    p1 = manifold.valid > 0 and float(manifold.clearance_m[ahead].min()) >= least_m - 1e-3
    points = manifold.points[ahead]
    p2 = manifold.valid > 1 and float((points[-1] - points[0]) @ (points[1] - points[0])) > 0.0
    p4 = told.drift_m_s <= lipschitz_m_s
    p5 = manifold.reach_m > max(told.normal_speed_m_s / lateral_gain_per_s, error_m)
    holds = p1 and p2 and told.same_branch and p4 and p5
    return Properties(p1, p2, told.same_branch, p4, p5, holds or stops)
