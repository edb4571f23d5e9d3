"""Settings of timed elastic bands."""

from pydantic import Field

from drivers.interface.settings import Settings


class ElasticBandSettings(Settings):
    """The band, its bounds, and the weights of its penalties; names follow the ROS package teb_local_planner."""

    max_speed_m_s: float = Field(0.8, gt=0.0, le=5.0, description="cruise cap, below the base's own")
    reverse_m_s: float = Field(0.2, ge=0.0, le=5.0, description="backwards; 0: never")
    acceleration_m_s2: float = Field(1.0, gt=0.0, le=10.0, description="planned with, below the base's own")
    acceleration_rad_s2: float = Field(2.5, gt=0.0, le=20.0, description="planned with, below the base's own")
    look_ahead_m: float = Field(3.0, gt=0.0, le=20.0, description="of the route that the band is laid along")
    step_s: float = Field(0.3, gt=0.0, le=2.0, description="wanted between two poses (dt_ref)")
    play_s: float = Field(0.1, ge=0.0, le=1.0, description="more or less than that before the band is resized (dt_hysteresis)")
    most_poses: int = Field(60, ge=3, le=500)
    rounds: int = Field(3, ge=1, le=20, description="of resizing, each with `iterations`")
    iterations: int = Field(8, ge=1, le=50, description="of Levenberg and Marquardt, in a round, at most")
    margin_m: float = Field(0.10, ge=0.0, le=2.0, description="least gap to what stands and moves")
    inflation_m: float = Field(0.35, ge=0.0, le=5.0, description="a smaller gap to what stands costs a little")
    moving_inflation_m: float = Field(0.5, ge=0.0, le=5.0, description="a smaller gap to what moves does")
    penalty_margin: float = Field(
        0.05, ge=0.0, le=0.5, description="inside of a bound where penalties begin, in its unit (epsilon)"
    )
    via_spacing_m: float = Field(0.6, gt=0.0, le=5.0, description="between points of the route that attract the band")
    weight_time: float = Field(1.0, ge=0.0, le=1e4)
    weight_sideways: float = Field(1000.0, ge=0.0, le=1e6, description="of moving sideways between two poses")
    weight_forward: float = Field(10.0, ge=0.0, le=1e6, description="of going backwards")
    weight_speed: float = Field(2.0, ge=0.0, le=1e4)
    weight_rate: float = Field(1.0, ge=0.0, le=1e4)
    weight_acceleration: float = Field(1.0, ge=0.0, le=1e4)
    weight_turning: float = Field(1.0, ge=0.0, le=1e4, description="of angular acceleration")
    weight_obstacle: float = Field(50.0, ge=0.0, le=1e6)
    weight_inflation: float = Field(0.2, ge=0.0, le=1e4)
    weight_moving: float = Field(50.0, ge=0.0, le=1e6)
    weight_moving_inflation: float = Field(0.2, ge=0.0, le=1e4)
    weight_via: float = Field(0.3, ge=0.0, le=1e4)
    obstacle_growth: float = Field(2.0, ge=1.0, le=10.0, description="of that weight from round to round (weight_adapt_factor)")
    ways: int = Field(2, ge=0, le=3, description="obstacles in the way that are tried on both sides")
    keep_way: float = Field(0.8, gt=0.0, le=1.0, description="cost of the way taken counts so much (selection_cost_hysteresis)")
    renewed_m: float = Field(1.0, gt=0.0, le=10.0, description="the band is laid anew when its end jumps so far")
    checked_s: float = Field(1.0, ge=0.0, le=10.0, description="of the band that must be free, else the robot brakes")
    arrival_m: float = Field(0.05, gt=0.0, le=1.0, description="this near the route's end the robot stands")
