"""Settings of the clearance-manifold planner: appendix B of the paper, and what it leaves open.

Constants per step are converted from the paper's control period of 0.2 s; the README says which settings the paper gives.
"""

from typing import Literal

from pydantic import Field

from drivers.interface.settings import Settings


class PredictionSettings(Settings):
    """Layer 1: the arrival-conditioned field (equation 2)."""

    confidence_decay_s: float = Field(default=2.5, gt=0.0, le=60.0, description="tau_decay: of confidence in what is out of view")
    trust_decay_s: float = Field(default=1.5, gt=0.0, le=60.0, description="tau_pred: of trust in a rate, over the horizon")
    horizon_max_s: float = Field(default=2.0, gt=0.0, le=10.0, description="H_max: no arrival is predicted later than this")
    nominal_speed_m_s: float = Field(
        default=0.4, gt=0.0, le=5.0, description="v_robot,nom: the speed that arrivals are expected at"
    )
    speed_floor_m_s: float = Field(default=0.05, gt=0.0, le=1.0, description="v_exec,floor: the least speed they are expected at")
    fov_deg: float = Field(default=120.0, gt=0.0, le=360.0, description="what the camera sees, for the confidence")
    range_m: float = Field(default=2.5, gt=0.1, le=20.0, description="how far it sees")
    near_m: float = Field(
        default=0.46, ge=0.0, le=2.0, description="and from how far on: the robot's middle to what its depth image begins with"
    )
    carry_s: float = Field(
        default=1.5, ge=0.0, le=10.0, description="what closes in is reckoned with for so long after it left the view"
    )


class ChartSettings(Settings):
    """The corridor chart: the centre line that offsets are measured from."""

    smoothing_m: float = Field(
        default=0.8, ge=0.0, le=5.0, description="length over which the route is smoothed into a centre line"
    )
    escape_m: float = Field(default=0.8, gt=0.0, le=5.0, description="a route this far off the centre line asks for a new one")
    escape_s: float = Field(default=0.6, ge=0.0, le=10.0, description="when it has been so far off for so long")


class SolverSettings(Settings):
    """Layer 2: stations, cross-sections, ridge, box and quadratic program."""

    stations_forward: int = Field(default=14, ge=4, le=100, description="stations ahead of the robot's own")
    stations_rear: int = Field(default=6, ge=1, le=50, description="stations behind it")
    horizon_m: float = Field(default=4.0, gt=0.5, le=20.0, description="L_horizon: how far ahead they reach")
    rear_m: float = Field(default=1.2, gt=0.1, le=10.0, description="L_rear: how far behind")
    cross_samples: int = Field(default=31, ge=5, le=201, description="M_cross: samples of a cross-section")
    half_width_m: float = Field(default=1.0, gt=0.1, le=5.0, description="half of a cross-section")
    margin_m: float = Field(default=0.08, ge=0.0, le=1.0, description="rho_min beyond the robot's radius: 0.20 m - 0.12 m")
    ample_m: float = Field(
        default=0.15, gt=0.0, le=1.0, description="beyond what the shield keeps: room that is kept where there is as much"
    )
    skip_s: float = Field(
        default=0.6, ge=0.0, le=10.0, description="N_skip = 3 steps: between two looks at the whole cross-section"
    )
    weight_data: float = Field(default=0.1, gt=0.0, le=100.0, description="w_1: cost of leaving the ridge")
    weight_smooth: float = Field(default=0.5, ge=0.0, le=100.0, description="w_smooth: cost of slope and curvature")
    weight_homotopy: float = Field(
        default=0.2, ge=0.0, le=100.0, description="w_homotopy: cost of leaving the branch followed so far"
    )
    ridge_enough_m: float = Field(default=0.6, gt=0.05, le=5.0, description="clearance beyond which more makes no better ridge")
    rear_confidence: float = Field(default=0.3, ge=0.0, le=1.0, description="least confidence of a rear station whose box counts")


class TrackerSettings(Settings):
    """Section 4.4: continuation, its tube and what ends it."""

    enabled: bool = Field(default=True, description="off: extracted anew every time (the paper's ablation 'no continuation')")
    weight_temporal: float = Field(default=0.2, ge=0.0, le=100.0, description="cost of leaving the manifold of the frame before")
    lipschitz_m_s: float = Field(default=0.5, gt=0.0, le=10.0, description="L of P4: how fast a manifold may move")
    tube_m: float = Field(default=0.10, gt=0.0, le=2.0, description="least radius of the tube that a station is searched in")
    hysteresis: float = Field(
        default=0.3, ge=0.0, le=10.0, description="clearance that a metre off the predicted offset must gain"
    )
    switch_gain_m: float = Field(default=0.05, ge=0.0, le=2.0, description="clearance per station that another branch must gain")
    doubt_s: float = Field(default=0.4, ge=0.0, le=10.0, description="for how long it must have been better by that")
    repaired_share: float = Field(
        default=0.3, ge=0.0, le=1.0, description="of the forward stations; fewer repaired: the tube collapsed"
    )
    step_share: float = Field(default=1.5, gt=0.0, le=10.0, description="dynamic-step fallback, in forward station spacings")
    lateral_m: float = Field(default=0.40, gt=0.0, le=5.0, description="lateral fallback")
    tangent_cosine: float = Field(default=0.30, ge=-1.0, le=1.0, description="tangent fallback")
    pose_jump_m: float = Field(default=0.50, gt=0.0, le=5.0, description="pose-jump fallback")
    goal_jump_m: float = Field(default=1.0, gt=0.0, le=20.0, description="goal-jump fallback")


class ControllerSettings(Settings):
    """Layer 3: the manifold dynamical system and its longitudinal law."""

    lateral_gain_per_s: float = Field(default=4.0, gt=0.0, le=50.0, description="k_perp")
    speed_m_s: float = Field(default=0.5, gt=0.0, le=5.0, description="v_max")
    commitment_m_s: float = Field(
        default=0.2, ge=0.0, le=2.0, description="Phi_0: speed added for full commitment to the prediction"
    )
    cruise_clearance_m: float = Field(default=0.4, gt=0.0, le=5.0, description="s_rho,ref: clearance that full speed asks for")
    margin_low_m: float = Field(default=0.0, ge=-1.0, le=1.0, description="s_low: margin over rho_min that gives no speed")
    margin_high_m: float = Field(default=0.15, gt=0.0, le=2.0, description="s_high: margin that gives full speed")
    deceleration_m_s2: float = Field(default=0.5, gt=0.0, le=10.0, description="a_decel of the braking law")
    delay_s: float = Field(default=0.05, ge=0.0, le=2.0, description="dt_delay: driven on before the brake takes hold")
    heading_gain_per_s: float = Field(default=2.0, ge=0.0, le=20.0, description="k_heading")
    heading_look_ahead_m: float = Field(
        default=1.0, gt=0.0, le=10.0, description="the heading is that of the manifold up to here"
    )
    yield_m: float = Field(
        default=0.56,
        ge=0.0,
        le=3.0,
        description="between the robot's edge and the middle of who closes in; 0: it does not yield",
    )
    yield_horizon_s: float = Field(default=2.5, gt=0.0, le=10.0, description="later encounters are not yielded to")
    view_margin_deg: float = Field(
        default=35.0, ge=0.0, le=90.0, description="what closes in is kept so far inside the edge of view"
    )
    progress_m_s: float = Field(default=0.10, ge=0.0, le=1.0, description="v_min,progress: anti-freeze floor along the manifold")
    body_m: float = Field(default=0.25, ge=0.0, le=2.0, description="kept from the unknown; nearer cells are stood on already")
    stale_s: float = Field(
        default=4.0,
        gt=0.5,
        le=3600.0,
        description="ground before a base that can strafe, not looked at for so long, is looked at first",
    )
    arrival_m: float = Field(default=0.05, gt=0.0, le=1.0, description="this near the goal it stands")
    look_ahead_m: float = Field(
        default=0.2, gt=0.01, le=2.0, description="of a base that cannot strafe: the point that is controlled"
    )
    turn_share: float = Field(
        default=0.7,
        gt=0.0,
        le=1.0,
        description="of a base that cannot strafe: share of its angular acceleration that turns count on",
    )
    turn_delay_s: float = Field(
        default=0.45, gt=0.0, le=2.0, description="of it too: e times what passes from what is asked to how it turns; 1 / gain"
    )
    look_margin_deg: float = Field(
        default=10.0, ge=0.0, le=90.0, description="of it too: what it stands and looks for is so far inside the edge of view"
    )


class SmoothnessSettings(Settings):
    """How the velocity asked follows the one wanted; of a base that can strafe."""

    enabled: bool = Field(default=True, description="off: it is asked for at once, as in the paper")
    jerk_m_s3: float = Field(default=3.0, gt=0.0, le=1000.0, description="used while nothing presses")
    urgent_m_s3: float = Field(default=15.0, gt=0.0, le=1000.0, description="used at most, to stop in time or let somebody pass")
    watchful_m_s3: float = Field(
        default=4.0, gt=0.0, le=1000.0, description="used at most to stop before an opening that the look-out finds late"
    )
    response_per_s: float = Field(default=6.0, gt=0.0, le=100.0, description="of small differences: faster noise is damped")
    slip_m_s: float = Field(
        default=0.2, gt=0.0, le=2.0, description="the base does something else (a shield) if it differs by this: go on from there"
    )


class LookoutSettings(Settings):
    """Beyond the paper: who may step out of what is not seen."""

    enabled: bool = Field(default=True, description="off: only what is seen counts, as in the paper")
    walker_speed_m_s: float = Field(default=1.25, gt=0.0, le=3.0, description="fastest walker who is reckoned with")
    patience_s: float = Field(
        default=4.0, gt=0.0, le=60.0, description="waited for that walker; after it slower ones, after twice of it none"
    )
    margin_m: float = Field(default=0.15, ge=0.0, le=1.0, description="between the robot and who steps out")
    width_m: float = Field(
        default=0.4, ge=0.1, le=2.0, description="of who steps out, at least; narrower openings let nobody through"
    )
    side_m: float = Field(default=2.4, gt=0.2, le=10.0, description="how far to the sides of the way is looked")
    ahead_m: float = Field(default=2.4, gt=0.5, le=10.0, description="how far along it")
    creep_m_s: float = Field(default=0.15, ge=0.0, le=1.0, description="speed where the robot stands in an opening already")
    reaction_s: float = Field(default=0.2, ge=0.0, le=2.0, description="from what is seen to what the base does")


class WaitingSettings(Settings):
    """While no way is free."""

    patience_s: float = Field(default=6.0, ge=0.0, le=600.0, description="how long it looks at what blocks the way, then around")
    turn_rad_s: float = Field(default=0.6, gt=0.0, le=6.0, description="how fast it turns meanwhile")
    blocked: Literal["stand", "make_way"] = Field(
        default="stand", description="what it does meanwhile: it stands, or stays there but makes way for who comes"
    )


class ClearanceManifoldSettings(Settings):
    """The three layers, and the look-out."""

    prediction: PredictionSettings = PredictionSettings()
    chart: ChartSettings = ChartSettings()
    solver: SolverSettings = SolverSettings()
    tracker: TrackerSettings = TrackerSettings()
    controller: ControllerSettings = ControllerSettings()
    smoothness: SmoothnessSettings = SmoothnessSettings()
    lookout: LookoutSettings = LookoutSettings()
    waiting: WaitingSettings = WaitingSettings()
