"""Settings of the tracker of fiducial markers."""

from __future__ import annotations

from pydantic import Field

from drivers.interface.settings import Settings


class MarkerSettings(Settings):
    """What is printed on what, and how it is followed."""

    side_m: float = Field(default=0.05, gt=0.0, le=2.0, description="of the black square")
    radius_m: float = Field(default=0.06, gt=0.0, le=2.0, description="of the disc around the marker that its carrier fills")
    sigma_px: float = Field(default=0.3, gt=0.0, le=10.0, description="of a corner, each axis")
    residual_max_px: float = Field(default=2.0, gt=0.0, le=50.0, description="RMS; corners that fit no square worse are none")
    speed_sigma_m_s: float = Field(default=0.3, gt=0.0, le=5.0, description="of a new track's velocity, each axis")
    acceleration_m_s2: float = Field(default=0.5, gt=0.0, le=20.0, description="standard deviation of what changes a velocity")
    gate: float = Field(default=13.8, gt=0.0, le=100.0, description="largest squared distance; 13.8: 99.9 % of two axes")
    hits_min: int = Field(default=2, ge=1, le=100, description="images in which a marker was seen before it is given out")
    coast_s: float = Field(default=1.0, ge=0.0, le=30.0, description="how long a track lives unseen")
