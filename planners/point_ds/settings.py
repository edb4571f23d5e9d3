"""Settings of the point attractor."""

from typing import Literal

from pydantic import Field

from drivers.interface.settings import Settings


class PointAttractorSettings(Settings):
    """Section 6 and appendix B, layer 3, of the clearance paper."""

    speed_m_s: float = Field(0.5, gt=0.0, le=5.0, description="largest speed (v_max)")
    attraction_per_s: float = Field(1.0, gt=0.0, le=20.0, description="goal-attraction gain, in place of k_parallel")
    heading_gain_per_s: float = Field(2.0, ge=0.0, le=20.0, description="turns the robot to where it moves (k_heading)")
    attractor: Literal["goal", "route"] = Field("goal", description="the goal, as in the paper, or a point ahead on the route")
    look_ahead_m: float = Field(0.8, gt=0.0, le=10.0, description="how far ahead that point lies, for attractor: route")
    standstill_m_s: float = Field(0.02, ge=0.0, le=1.0, description="below this speed the heading is left alone")
