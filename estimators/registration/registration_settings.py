"""What registration looks at, how far it is believed, and what is kept."""

from __future__ import annotations

from pydantic import Field

from drivers.interface.settings import Settings


class RegistrationSettings(Settings):
    """What is registered, how far it is believed, and what is kept."""

    enabled: bool = Field(default=False, description="whether frames correct map_from_odom")
    range_max_m: float = Field(default=5.0, gt=0.5, le=40.0, description="farther points take no part")
    sectors: int = Field(default=212, ge=16, le=848, description="most points that are taken from a depth image")
    noise_floor_m: float = Field(default=0.005, gt=0.0, le=0.5, description="deviation of a point that is near")
    noise_per_m: float = Field(default=0.002, ge=0.0, le=0.1, description="times range squared, is added to it (stereo depth)")
    correlated_points: float = Field(default=10.0, ge=1.0, le=1000.0, description="so many neighbours share one error")
    piece_min_m: float = Field(default=0.6, ge=0.2, le=10.0, description="shorter straight pieces of surface say nothing")
    piece_points_min: int = Field(default=8, ge=3, le=1000, description="nor do those with fewer points")
    piece_gap_m: float = Field(default=0.4, gt=0.0, le=5.0, description="between neighbours that do not hang together")
    piece_deviation_m: float = Field(default=0.02, gt=0.0, le=1.0, description="from straight, of a piece's points, beside noise")
    gate_m: float = Field(default=0.1, gt=0.0, le=1.0, description="point to line, beyond three deviations of the prediction")
    gate_max_m: float = Field(default=0.4, gt=0.0, le=2.0, description="point to line, at most")
    gate_angle_rad: float = Field(default=0.26, gt=0.0, le=1.0, description="surface to line")
    beyond_m: float = Field(default=1.0, ge=0.0, le=10.0, description="how far beyond its ends a line is still the same wall")
    iterations_max: int = Field(default=6, ge=1, le=50, description="of Gauss-Newton, per frame")
    points_min: int = Field(default=12, ge=3, le=1000, description="fewer points on lines determine nothing")
    determined_share: float = Field(default=0.01, gt=0.0, le=0.5, description="least eigenvalue of a determined direction")
    correction_max_m: float = Field(default=0.5, gt=0.0, le=5.0, description="a frame that asks for more is not believed")
    correction_max_rad: float = Field(default=0.35, gt=0.0, le=1.5, description="a frame that asks for more is not believed")
    drift_per_sqrt_m: float = Field(default=0.03, gt=0.0, le=1.0, description="of odometry's position, in m per root of m")
    drift_rad_per_sqrt_m: float = Field(default=0.02, gt=0.0, le=1.0, description="of its heading, per root of m")
    drift_rad_per_sqrt_s: float = Field(default=0.01, gt=0.0, le=1.0, description="of its heading, per root of s")
    lines_max: int = Field(default=64, ge=2, le=1024, description="references that are kept")
    trusted_after: int = Field(default=8, ge=1, le=1000, description="frames that must have seen a line before it corrects")
    settle_frames: int = Field(default=10, ge=1, le=1000, description="frames that place a new line; then only key frames add")
    key_m: float = Field(default=0.2, gt=0.0, le=10.0, description="way between key frames")
    key_rad: float = Field(default=0.2, gt=0.0, le=3.0, description="or turn between them")
