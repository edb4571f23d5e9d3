"""Settings of optimal reciprocal collision avoidance."""

from pydantic import Field

from drivers.interface.settings import Settings


class ReciprocalAvoidanceSettings(Settings):
    """How far ahead it looks, who gives way, and how the base follows the velocity chosen."""

    max_speed_m_s: float = Field(0.8, gt=0.0, le=5.0, description="preferred speed, below the base's own")
    look_ahead_m: float = Field(1.5, gt=0.0, le=10.0, description="farthest point of the route that is aimed at")
    horizon_s: float = Field(3.0, gt=0.0, le=20.0, description="for which no agent is to be hit (tau)")
    standing_horizon_s: float = Field(1.0, gt=0.0, le=20.0, description="for which nothing that stands is to be hit")
    responsibility: float = Field(1.0, ge=0.5, le=1.0, description="share of avoiding: 0.5 among agents that do it too, 1 alone")
    margin_m: float = Field(0.05, ge=0.0, le=1.0, description="kept free beyond the robot's radius")
    tracking_error_m: float = Field(0.10, gt=0.0, le=1.0, description="allowed beside a holonomic robot (epsilon); widens it")
    least_tracking_error_m: float = Field(0.03, gt=0.0, le=1.0, description="what is left of it where there is no room")
    turn_s: float = Field(0.35, gt=0.0, le=5.0, description="to face a new velocity (T), where the rate allows it")
    boundary_range_m: float = Field(2.0, gt=0.0, le=10.0, description="where boundary cells are looked for")
    boundary_spacing_m: float = Field(0.12, gt=0.0, le=1.0, description="between those that are used")
    boundary_points: int = Field(64, ge=1, le=512, description="of these, at most; the nearest")
    arrival_m: float = Field(0.05, gt=0.0, le=1.0, description="this near the route's end the robot stands")
