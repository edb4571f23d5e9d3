"""Settings of the dynamic window approach."""

from pydantic import Field

from drivers.interface.settings import Settings


class DynamicWindowSettings(Settings):
    """What is sampled, what counts as admissible, and what is preferred."""

    max_speed_m_s: float = Field(0.5, gt=0.0, le=5.0, description="cruise cap, below the base's own")
    window_s: float = Field(0.25, gt=0.0, le=2.0, description="velocities that can be reached within this time are sampled")
    samples_vx: int = Field(11, ge=3, le=101)
    samples_vy: int = Field(7, ge=3, le=101, description="for a base that can strafe")
    samples_wz: int = Field(11, ge=3, le=101)
    horizon_s: float = Field(1.5, gt=0.0, le=10.0, description="how far an arc is rolled out")
    steps: int = Field(15, ge=2, le=200, description="points along an arc")
    look_ahead_m: float = Field(1.2, gt=0.0, le=10.0, description="farthest point of the route that is aimed at")
    margin_m: float = Field(0.10, ge=0.0, le=1.0, description="kept free beyond the robot's radius")
    reaction_time_s: float = Field(0.1, ge=0.0, le=2.0, description="driven on before a brake takes hold")
    stop_before_unknown: bool = Field(True, description="be able to stop before entering cells that were never seen")
    body_m: float = Field(0.25, ge=0.0, le=2.0, description="distance kept from the unknown; nearer cells are stood on already")
    weight_progress: float = Field(1.0, ge=0.0, le=100.0, description="approach to the point aimed at")
    weight_facing: float = Field(0.35, ge=0.0, le=100.0, description="heading towards the point aimed at")
    weight_clearance: float = Field(0.25, ge=0.0, le=100.0, description="room along the arc")
    weight_speed: float = Field(0.05, ge=0.0, le=100.0)
    weight_blind: float = Field(1.2, ge=0.0, le=100.0, description="cost of moving other than forwards, where the camera looks")
    weight_change: float = Field(0.05, ge=0.0, le=100.0, description="cost of leaving the velocity driven now")
    comfort_m: float = Field(0.3, gt=0.0, le=5.0, description="room beyond the margin that more is worth nothing")
    facing_s: float = Field(0.5, gt=0.0, le=5.0, description="when the heading is judged")
    arrival_m: float = Field(0.05, gt=0.0, le=1.0, description="this near the route's end the robot stands")
    stall_s: float = Field(1.5, gt=0.0, le=60.0, description="after standing this long with a route, it turns to look around")
    look_around_rad_s: float = Field(0.6, gt=0.0, le=5.0)
