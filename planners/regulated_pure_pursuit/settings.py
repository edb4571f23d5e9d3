"""Settings of regulated pure pursuit: Nav2's, with its defaults where the README does not say otherwise."""

from pydantic import Field, model_validator

from drivers.interface.settings import Settings


class RegulatedPurePursuitSettings(Settings):
    """Where on the path it aims, what slows it down, when it turns on the spot and how far it looks for collisions."""

    max_speed_m_s: float = Field(0.5, gt=0.0, le=5.0, description="desired_linear_vel: cruise speed, below the base's own cap")
    lookahead_time_s: float = Field(1.5, gt=0.0, le=10.0, description="the carrot lies as far as it drives in this time,")
    min_lookahead_m: float = Field(0.3, gt=0.0, le=10.0, description="but no nearer than this")
    max_lookahead_m: float = Field(0.9, gt=0.0, le=10.0, description="and no farther than this")
    fixed_curvature_lookahead: bool = Field(False, description="take the curvature from a carrot at a distance of its own")
    curvature_lookahead_m: float = Field(0.6, gt=0.0, le=10.0, description="that distance")
    regulate_by_curvature: bool = Field(True, description="slow down in curves")
    min_radius_m: float = Field(
        0.9, gt=0.0, le=10.0, description="regulated_linear_scaling_min_radius: a curve sharper than this"
    )
    regulate_by_clearance: bool = Field(True, description="slow down near obstacles (cost regulation)")
    clearance_scaling_m: float = Field(0.6, gt=0.0, le=10.0, description="cost_scaling_dist: nearer than this, of the centre")
    clearance_gain: float = Field(1.0, gt=0.0, le=1.0, description="cost_scaling_gain: speed share at that distance")
    min_regulated_speed_m_s: float = Field(0.25, ge=0.0, le=5.0, description="curves and obstacles slow it no further than this")
    approach_scaling_m: float = Field(0.6, gt=0.0, le=10.0, description="from here on it slows down towards the route's end")
    min_approach_speed_m_s: float = Field(0.05, gt=0.0, le=5.0, description="no further than this")
    rotate_to_heading: bool = Field(True, description="turn on the spot towards a path that lies aside")
    rotate_min_angle_rad: float = Field(0.785, gt=0.0, le=3.15, description="by more than this")
    rotate_rad_s: float = Field(1.8, gt=0.0, le=10.0, description="rotate_to_heading_angular_vel, below the base's own cap")
    time_to_collision_s: float = Field(1.0, ge=0.0, le=10.0, description="no command collides within this; 0: not checked")
    margin_m: float = Field(0.05, ge=0.0, le=1.0, description="kept free beyond the robot's radius")
    arrival_m: float = Field(0.05, gt=0.0, le=1.0, description="this near the route's end it stands, or turns as asked")
    path_spacing_m: float = Field(0.05, gt=0.0, le=0.5, description="between points of the path that is followed")

    @model_validator(mode="after")
    def _lookaheads_are_ordered(self) -> "RegulatedPurePursuitSettings":
        if self.min_lookahead_m > self.max_lookahead_m:
            raise ValueError("min_lookahead_m must not exceed max_lookahead_m")
        return self
