"""Settings of model predictive control with control barriers."""

from pydantic import Field

from drivers.interface.settings import Settings


class BarrierMpcSettings(Settings):
    """The horizon, what is preferred, the barriers, and how long the solver may try."""

    max_speed_m_s: float = Field(0.8, gt=0.0, le=5.0, description="cruise cap, below the base's own")
    reverse_m_s: float = Field(0.2, ge=0.0, le=5.0, description="backwards, to back out; 0: never")
    step_s: float = Field(0.1, gt=0.0, le=1.0, description="of the prediction")
    steps: int = Field(20, ge=3, le=60, description="of the prediction (N)")
    iterations: int = Field(1, ge=1, le=10, description="quadratic programs for one decision")
    barrier_rate_per_s: float = Field(
        1.0, gt=0.0, le=50.0, description="how fast a barrier may fall; gamma is 1 - exp(-rate step)"
    )
    margin_m: float = Field(0.07, ge=0.0, le=1.0, description="kept free beyond the robot's radius")
    tracks: int = Field(6, ge=0, le=32, description="of which the nearest are constraints")
    boundary_points: int = Field(12, ge=0, le=64, description="of what stands, the nearest to the last plan")
    boundary_spacing_m: float = Field(0.2, gt=0.0, le=2.0, description="between these")
    boundary_range_m: float = Field(1.5, gt=0.0, le=10.0, description="from the last plan, where they are looked for")
    weight_position: float = Field(4.0, ge=0.0, le=1e4, description="of the squared distance to the reference [1/m^2]")
    weight_terminal: float = Field(4.0, ge=1.0, le=1e4, description="times as much at the end of the horizon")
    weight_heading: float = Field(0.4, ge=0.0, le=1e4, description="of the squared heading error [1/rad^2]")
    weight_speed: float = Field(0.2, ge=0.0, le=1e4, description="of the squared difference to the reference's speed")
    weight_turn: float = Field(0.1, ge=0.0, le=1e4, description="of the squared rate [s^2/rad^2]")
    weight_change: float = Field(0.5, ge=0.0, le=1e4, description="of the squared change of the inputs between steps")
    weight_slack: float = Field(200.0, gt=0.0, le=1e6, description="of a metre by which barriers fall too fast, at a step")
    solver_iterations: int = Field(160, ge=10, le=4000, description="of OSQP, for one quadratic program")
    arrival_m: float = Field(0.05, gt=0.0, le=1.0, description="this near the route's end the robot stands")
