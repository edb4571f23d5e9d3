"""Settings of the joint way-point planner."""

from pydantic import Field

from drivers.interface.settings import Settings


class JointWaypointsSettings(Settings):
    """Where the arm is to go, one after the other, and how much of its limits it may use."""

    waypoints_rad: tuple[tuple[float, ...], ...] = Field((), description="positions of all joints, one row for each way-point")
    rounds: int = Field(1, ge=1, le=10_000, description="how often the way-points are gone through")
    velocity_share: float = Field(0.3, gt=0.0, le=1.0, description="of the joints' velocity limits")
    acceleration_share: float = Field(0.2, gt=0.0, le=1.0, description="of the acceleration limits")
    jerk_share: float = Field(0.2, gt=0.0, le=1.0, description="of the jerk limits")
    tolerance_rad: float = Field(0.02, gt=0.0, le=0.5, description="a way-point is reached when every joint is this near")
    standstill_rad_s: float = Field(0.05, gt=0.0, le=1.0, description="and this slow")
    astray_rad: float = Field(0.15, gt=0.0, le=3.0, description="from the trajectory; then a new one begins where the arm is")
    knots: int = Field(17, ge=3, le=200, description="of a trajectory between two way-points")
