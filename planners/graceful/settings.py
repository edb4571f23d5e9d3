"""Settings of the graceful controller: Nav2's, with its defaults where the README does not say otherwise."""

from pydantic import Field, model_validator

from drivers.interface.settings import Settings


class GracefulSettings(Settings):
    """The control law, how far it looks along the path, and when it turns on the spot."""

    max_speed_m_s: float = Field(0.5, gt=0.0, le=5.0, description="v_linear_max: cruise speed, below the base's own cap")
    min_speed_m_s: float = Field(0.1, gt=0.0, le=5.0, description="v_linear_min: a sharp curve slows it no further than this")
    max_turn_rad_s: float = Field(1.0, gt=0.0, le=10.0, description="v_angular_max, below the base's own cap")
    min_turn_rad_s: float = Field(0.25, gt=0.0, le=10.0, description="v_angular_min_in_place: least rate of a turn on the spot")
    k_phi: float = Field(2.0, gt=0.0, le=20.0, description="k_1: how much faster the heading error vanishes than the distance")
    k_delta: float = Field(1.0, gt=0.0, le=20.0, description="k_2: gain of the steering")
    beta: float = Field(0.4, ge=0.0, le=20.0, description="how much a curve slows it down")
    exponent: float = Field(2.0, ge=1.0, le=10.0, description="lambda: how sharply it does")
    slowdown_radius_m: float = Field(0.75, gt=0.0, le=10.0, description="this near its target it slows down")
    min_lookahead_m: float = Field(0.25, gt=0.0, le=10.0, description="nearest target on the path, short of its end")
    max_lookahead_m: float = Field(1.0, gt=0.0, le=10.0, description="farthest target")
    initial_rotation: bool = Field(True, description="turn on the spot towards a target that lies aside")
    initial_rotation_tolerance_rad: float = Field(0.75, gt=0.0, le=3.15, description="by more than this")
    prefer_final_rotation: bool = Field(True, description="arrive as the way leads and turn there, rather than in a sweep")
    rotation_gain: float = Field(0.5, gt=0.0, le=10.0, description="rotation_scaling_factor: of the angle, in shares of the rate")
    margin_m: float = Field(0.05, ge=0.0, le=1.0, description="kept free beyond the robot's radius")
    arrival_m: float = Field(0.05, gt=0.0, le=1.0, description="this near the route's end it stands, or turns as asked")
    path_spacing_m: float = Field(0.05, gt=0.0, le=0.5, description="between points of the path that is followed")

    @model_validator(mode="after")
    def _ranges_are_ordered(self) -> "GracefulSettings":
        for low, high in (("min_speed_m_s", "max_speed_m_s"), ("min_lookahead_m", "max_lookahead_m")):
            if getattr(self, low) > getattr(self, high):
                raise ValueError(f"{low} must not exceed {high}")
        return self
